//! Line charts as SVG: values over categories with intervals and single observations, in panels side by side.
//!
//! No fonts, scripts or files from elsewhere. The picture brings its own background, light or dark as the viewer prefers, so it is
//! readable on any page. Series differ by colour, marker and dash.

use std::fmt::Write;

/// A figure of panels that share their x axis, title and legend.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Above everything.
    pub title: String,
    /// Under each panel.
    pub x_label: String,
    /// Left of the first panel.
    pub y_label: String,
    /// What lines, bars and dots mean.
    pub note: String,
    /// Names of the categories, from the left.
    pub x_ticks: Vec<String>,
    /// From the left.
    pub panels: Vec<Panel>,
}

/// One pair of axes; the y axis ends at 1 and begins below the lowest value of all panels, so that they compare at sight.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// Above the axes.
    pub title: String,
    /// At most [`MOST_SERIES`]; the same position has the same look in every panel.
    pub series: Vec<Series>,
}

/// One line.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// In the legend.
    pub name: String,
    /// From the left.
    pub points: Vec<Point>,
}

/// One value, a share between 0 and 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Index into [`Chart::x_ticks`].
    pub x: usize,
    /// The value.
    pub value: f64,
    /// Its interval, low and high.
    pub interval: [f64; 2],
    /// The observations that the value pools.
    pub singles: Vec<f64>,
}

/// Colours of Okabe and Ito that are told apart by colour-blind eyes, and stand out on white and on black.
const COLORS: [&str; MOST_SERIES] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7"];
/// Dash patterns; the first and the third are solid.
const DASHES: [&str; MOST_SERIES] = ["none", "6 4", "none", "2 3"];
/// Series that can be told apart.
pub const MOST_SERIES: usize = 4;

// Sizes in pixels.
const PLOT_WIDTH: f64 = 300.0;
const PLOT_HEIGHT: f64 = 280.0;
const LEFT: f64 = 68.0;
const GAP: f64 = 56.0;
const RIGHT: f64 = 20.0;
const TOP: f64 = 84.0;
const BOTTOM: f64 = 78.0;
/// Series stand this far apart at the same category, so that their intervals can be told apart; more would make lines cross that do not.
const DODGE: f64 = 4.0;
/// Single observations stand this far right of their value.
const SINGLES_RIGHT: f64 = 5.0;
/// Legend entries stand this far apart.
const LEGEND_STEP: f64 = 64.0;
/// Half a marker.
const MARKER: f64 = 4.5;

/// Steps of the y axis, the finest first; the first with at most [`MOST_TICKS`] steps is taken.
const Y_STEPS: [f64; 5] = [0.01, 0.02, 0.05, 0.1, 0.2];
const MOST_TICKS: f64 = 6.0;

const STYLE: &str = "text{font-family:system-ui,-apple-system,Segoe UI,Helvetica,Arial,sans-serif;font-size:13px;fill:#24292f}\
    .title{font-size:15px;font-weight:600}.small{font-size:12px}.back{fill:#ffffff}.grid{stroke:#d0d7de}.axis{stroke:#57606a}\
    @media (prefers-color-scheme:dark){text{fill:#e6edf3}.back{fill:#0d1117}.grid{stroke:#30363d}.axis{stroke:#8b949e}}";

impl Chart {
    /// The picture. Each value is one element of class `mean` with its interval of class `interval`, each observation one of class `single`.
    pub fn to_svg(&self) -> String {
        let panels = self.panels.len().max(1) as f64;
        let width = LEFT + panels * PLOT_WIDTH + (panels - 1.0) * GAP + RIGHT;
        let height = TOP + PLOT_HEIGHT + BOTTOM;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
             role=\"img\" aria-label=\"{}\">\n<style>{STYLE}</style>\n<rect class=\"back\" width=\"{width}\" height=\"{height}\" rx=\"8\"/>\n",
            escaped(&self.title)
        );
        svg += &text(LEFT, 26.0, "start", "title", &self.title);
        svg += &self.legend();
        let middle = TOP + PLOT_HEIGHT / 2.0;
        let label = escaped(&self.y_label);
        svg += &format!("<text transform=\"translate(18 {middle}) rotate(-90)\" text-anchor=\"middle\">{label}</text>\n");
        for (i, panel) in self.panels.iter().enumerate() {
            svg += &self.axes(panel, LEFT + i as f64 * (PLOT_WIDTH + GAP));
        }
        svg += &text(LEFT, height - 14.0, "start", "small", &self.note);
        svg + "</svg>\n"
    }

    /// Names of the series, in the order of the panel that has most.
    fn legend(&self) -> String {
        let names = self.panels.iter().max_by_key(|p| p.series.len()).map_or(&[][..], |p| &p.series);
        let entry = |(i, series): (usize, &Series)| {
            let x = LEFT + i as f64 * LEGEND_STEP;
            let (color, dash) = (COLORS[i % MOST_SERIES], DASHES[i % MOST_SERIES]);
            let line = format!(
                "<path d=\"M{x} 48h22\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\" stroke-dasharray=\"{dash}\"/>\n"
            );
            line + &marker(i, x + 11.0, 48.0, "key") + &text(x + 28.0, 52.0, "start", "", &series.name)
        };
        names.iter().enumerate().map(entry).collect()
    }

    /// One panel with its left edge at `left`.
    fn axes(&self, panel: &Panel, left: f64) -> String {
        let (low, step) = y_axis(&self.panels);
        let y = |value: f64| TOP + PLOT_HEIGHT * (1.0 - value) / (1.0 - low);
        let category = PLOT_WIDTH / self.x_ticks.len().max(1) as f64;
        let x = |index: usize| left + category * (index as f64 + 0.5);
        let (bottom, right) = (TOP + PLOT_HEIGHT, left + PLOT_WIDTH);
        let mut svg = text(left + PLOT_WIDTH / 2.0, TOP - 10.0, "middle", "", &panel.title);
        for tick in 0..=((1.0 - low) / step).round() as u32 {
            let value = low + f64::from(tick) * step;
            let at = y(value);
            let _ = writeln!(svg, "<path class=\"grid\" d=\"M{left:.1} {at:.1}H{right:.1}\"/>");
            svg += &text(left - 8.0, at + 4.0, "end", "small", &format!("{:.0} %", 100.0 * value));
        }
        let _ = writeln!(svg, "<path class=\"axis\" fill=\"none\" d=\"M{left:.1} {TOP:.1}V{bottom:.1}H{right:.1}\"/>");
        for (i, name) in self.x_ticks.iter().enumerate() {
            svg += &text(x(i), bottom + 18.0, "middle", "small", name);
        }
        svg += &text(left + PLOT_WIDTH / 2.0, bottom + 38.0, "middle", "", &self.x_label);
        for (i, series) in panel.series.iter().enumerate() {
            let shift = DODGE * (i as f64 - (panel.series.len() as f64 - 1.0) / 2.0);
            svg += &line(i, series, |index| x(index) + shift, y);
        }
        svg
    }
}

/// One series in one panel.
fn line(look: usize, series: &Series, x: impl Fn(usize) -> f64, y: impl Fn(f64) -> f64) -> String {
    let (color, dash) = (COLORS[look % MOST_SERIES], DASHES[look % MOST_SERIES]);
    let ends: Vec<String> = series.points.iter().map(|p| format!("{:.1} {:.1}", x(p.x), y(p.value))).collect();
    let way = ends.join("L");
    let mut svg =
        format!("<path d=\"M{way}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\" stroke-dasharray=\"{dash}\"/>\n");
    for point in &series.points {
        let (at, [low, high]) = (x(point.x), point.interval.map(&y));
        let bar = format!("M{at:.1} {low:.1}V{high:.1}M{:.1} {low:.1}h6M{:.1} {high:.1}h6", at - 3.0, at - 3.0);
        let _ = writeln!(svg, "<path class=\"interval\" d=\"{bar}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.5\"/>");
        for single in &point.singles {
            let (cx, cy) = (at + SINGLES_RIGHT, y(*single));
            let _ = writeln!(
                svg,
                "<circle class=\"single\" cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"2\" fill=\"{color}\" opacity=\"0.6\"/>"
            );
        }
        svg += &marker(look, at, y(point.value), "mean");
    }
    svg
}

/// Circle, square, diamond or triangle around a point.
fn marker(look: usize, x: f64, y: f64, class: &str) -> String {
    let (m, side) = (MARKER, 2.0 * MARKER);
    let shape = match look % MOST_SERIES {
        0 => format!("M{:.1} {y:.1}a{m} {m} 0 1 0 {side} 0a{m} {m} 0 1 0 -{side} 0z", x - m),
        1 => format!("M{:.1} {:.1}h{side}v{side}h-{side}z", x - m, y - m),
        2 => format!("M{x:.1} {:.1}l{m} {m}l-{m} {m}l-{m} -{m}z", y - m),
        _ => format!("M{x:.1} {:.1}l{m} {side}h-{side}z", y - m),
    };
    format!("<path class=\"{class}\" d=\"{shape}\" fill=\"{}\"/>\n", COLORS[look % MOST_SERIES])
}

/// Lowest value and step of the y axis.
fn y_axis(panels: &[Panel]) -> (f64, f64) {
    let points = panels.iter().flat_map(|panel| &panel.series).flat_map(|s| &s.points);
    let lowest = points.flat_map(|p| p.singles.iter().copied().chain([p.value, p.interval[0]])).fold(1.0, f64::min);
    let floor = |step: f64| ((lowest / step).floor() * step).clamp(0.0, 1.0 - step);
    let fits = |step: &f64| (1.0 - floor(*step)) / step <= MOST_TICKS + 0.5;
    let step = Y_STEPS.into_iter().find(fits).unwrap_or(Y_STEPS[Y_STEPS.len() - 1]);
    (floor(step), step)
}

fn text(x: f64, y: f64, anchor: &str, class: &str, words: &str) -> String {
    format!("<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" class=\"{class}\">{}</text>\n", escaped(words))
}

fn escaped(words: &str) -> String {
    words.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart() -> Chart {
        let series = |name: &str, first: f64, missing: usize| {
            let point = |x: usize| {
                let value = first + 0.05 * x as f64;
                Point { x, value, interval: [value - 0.03, value + 0.01], singles: vec![value - 0.01; x + 1] }
            };
            Series { name: name.into(), points: (missing..3).map(point).collect() }
        };
        let panel = |title: &str, first: f64| Panel {
            title: title.into(),
            series: vec![series("a & b", first, 0), series("c<d", first, 1)],
        };
        Chart {
            title: "\"success\" > 0".into(),
            x_label: "demos".into(),
            y_label: "success".into(),
            note: String::new(),
            x_ticks: ["25", "50", "100"].map(String::from).to_vec(),
            panels: vec![panel("one", 0.87), panel("two", 0.1)],
        }
    }

    #[test]
    fn the_picture_parses_and_has_one_marker_for_each_datum() {
        let (chart, svg) = (chart(), chart().to_svg());
        let document = roxmltree::Document::parse(&svg).expect("XML");
        let count = |class: &str| document.descendants().filter(|n| n.attribute("class") == Some(class)).count();
        let points: Vec<&Point> = chart.panels.iter().flat_map(|p| &p.series).flat_map(|s| &s.points).collect();
        assert_eq!((points.len(), count("mean"), count("interval")), (10, 10, 10));
        assert_eq!(count("single"), points.iter().map(|p| p.singles.len()).sum::<usize>());
        let words: Vec<&str> = document.descendants().filter_map(|n| n.text()).collect();
        for word in ["a & b", "c<d", "\"success\" > 0", "demos", "25", "100", "80 %", "100 %", "0 %"] {
            assert!(words.contains(&word), "{word} is not written in {words:?}");
        }
    }

    #[test]
    fn higher_values_stand_higher_and_inside_the_axes() {
        let svg = chart().to_svg();
        let document = roxmltree::Document::parse(&svg).expect("XML");
        let heights: Vec<f64> = document
            .descendants()
            .filter(|n| n.attribute("class") == Some("single"))
            .map(|n| n.attribute("cy").and_then(|y| y.parse().ok()).expect("a height"))
            .collect();
        assert!(heights.iter().all(|y| (TOP..=TOP + PLOT_HEIGHT).contains(y)), "{heights:?}");
        assert!(heights[0] > heights[1] && heights[1] > heights[3], "{heights:?}");
    }

    #[test]
    fn the_y_axis_is_fine_near_one_and_begins_at_zero_for_low_values() {
        let (panels, close) = (chart().panels, |a: f64, b: f64| (a - b).abs() < 1e-9);
        let ((low, step), (zero, coarse)) = (y_axis(&panels[..1]), y_axis(&panels));
        assert!(close(low, 0.80) && close(step, 0.05) && close(zero, 0.0) && close(coarse, 0.2), "{low} {step} {zero} {coarse}");
    }
}
