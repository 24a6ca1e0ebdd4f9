//! Line charts: values over an axis with intervals and single observations, in panels side by side.

use super::picture::{Picture, color, escaped, legend, marker, names_at, stroke, text, width_of, width_with};
use super::scale::{Axis, Scale, up_to_one};
use std::fmt::Write;

/// A figure of panels that share their axes, title and legend.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Name of its file without ending.
    pub id: String,
    /// Above everything.
    pub title: String,
    /// The same for who cannot see it.
    pub description: String,
    /// Under each panel.
    pub x_label: String,
    /// Left of the first panel.
    pub y_label: String,
    /// What lines, bars and dots mean.
    pub note: String,
    /// What the horizontal axis counts.
    pub x: Axis,
    /// Whether values are written as percentages.
    pub percent: bool,
    /// From the left, three in a row.
    pub panels: Vec<Panel>,
}

/// One pair of axes; the y axis ends at 1 and begins below the lowest value of all panels, so that they compare at sight.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// Above the axes.
    pub title: String,
    /// The same look is the same thing in every panel.
    pub series: Vec<Series>,
}

/// One line.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// In the legend and at the line's end.
    pub name: String,
    /// Its colour, marker and dash, below [`super::LOOKS`].
    pub look: usize,
    /// From the left.
    pub points: Vec<Point>,
    /// Many points: intervals are a band, and a few points have markers.
    pub dense: bool,
}

/// One value, a share between 0 and 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Its place on the horizontal axis.
    pub x: f64,
    /// The value.
    pub value: f64,
    /// Its interval, low and high.
    pub interval: [f64; 2],
    /// The observations that the value pools.
    pub singles: Vec<f64>,
}

// Sizes in pixels; [`super::Panels`] has those that are its own.
pub(super) const PLOT_WIDTH: f64 = 280.0;
const PLOT_HEIGHT: f64 = 260.0;
pub(super) const LEFT: f64 = 68.0;
pub(super) const RIGHT: f64 = 12.0;
pub(super) const TOP: f64 = 92.0;
pub(super) const BOTTOM: f64 = 40.0;
/// Between two rows of panels, for ticks, label and title.
const BETWEEN: f64 = 82.0;
/// Under the last row, for ticks and label.
const UNDER: f64 = 38.0;
/// Right of each panel, for the next one's numbers, beside the names at the ends of its lines.
pub(super) const GAP: f64 = 62.0;
/// Single observations stand this far right of their value.
const SINGLES_RIGHT: f64 = 5.0;
/// Markers of a dense line.
const FEW_MARKERS: usize = 6;
/// The last point is the last marker, however its place is rounded.
const ROUNDING: f64 = 1e-9;
/// Panels in a row.
pub(super) const COLUMNS: usize = 3;

impl Chart {
    /// The picture. Each value is one element of class `mean` with its interval of class `interval`, each observation one of class `single`;
    /// of a dense line only some values are, and the interval is a `band`.
    pub fn draw(&self) -> Picture {
        let columns = self.panels.len().clamp(1, COLUMNS);
        let rows = self.panels.len().div_ceil(COLUMNS).max(1);
        let gap = self.gap();
        let width = LEFT + columns as f64 * (PLOT_WIDTH + gap) + RIGHT;
        let height = TOP + rows as f64 * (PLOT_HEIGHT + BETWEEN) - BETWEEN + UNDER + BOTTOM;
        let mut svg = text(LEFT, 26.0, "start", "chart-title", &self.title);
        svg += &legend(&self.names(), LEFT, 50.0);
        let scale = Scale::over(&self.x, self.panels.iter().flat_map(|p| &p.series).flat_map(|s| &s.points).map(|p| p.x));
        for (i, panel) in self.panels.iter().enumerate() {
            let left = LEFT + (i % COLUMNS) as f64 * (PLOT_WIDTH + gap);
            let top = TOP + (i / COLUMNS) as f64 * (PLOT_HEIGHT + BETWEEN);
            svg += &self.axes(panel, &scale, left, top);
            if i % COLUMNS == 0 {
                let (middle, label) = (top + PLOT_HEIGHT / 2.0, escaped(&self.y_label));
                svg += &format!("<text transform=\"translate(18 {middle}) rotate(-90)\" text-anchor=\"middle\">{label}</text>\n");
            }
        }
        svg += &text(LEFT, height - 14.0, "start", "chart-small", &self.note);
        let Chart { id, title, description, .. } = self.clone();
        Picture { id, title, description, size: [width_with(&self.title, LEFT, width), height], body: svg }
    }

    /// Right of each panel.
    fn gap(&self) -> f64 {
        let ends = self.panels.iter().filter(|p| p.series.len() > 1).flat_map(|p| &p.series).map(|s| width_of(&s.name));
        GAP + ends.fold(0.0, f64::max)
    }

    /// Names of the looks, in the order of their first panel.
    fn names(&self) -> Vec<(usize, &str)> {
        let mut names: Vec<(usize, &str)> = Vec::new();
        for series in self.panels.iter().flat_map(|panel| &panel.series) {
            if !names.iter().any(|(look, name)| (*look, *name) == (series.look, series.name.as_str())) {
                names.push((series.look, &series.name));
            }
        }
        names
    }

    /// One panel with its upper left corner there.
    fn axes(&self, panel: &Panel, scale: &Scale, left: f64, top: f64) -> String {
        let (low, step) = up_to_one(lowest(&self.panels));
        let y = |value: f64| top + PLOT_HEIGHT * (1.0 - value) / (1.0 - low);
        let x = |value: f64| left + PLOT_WIDTH * scale.share(value);
        let (bottom, right) = (top + PLOT_HEIGHT, left + PLOT_WIDTH);
        let mut svg = text(left + PLOT_WIDTH / 2.0, top - 10.0, "middle", "", &panel.title);
        for tick in 0..=((1.0 - low) / step).round() as u32 {
            let value = low + f64::from(tick) * step;
            let at = y(value);
            let _ = writeln!(svg, "<path class=\"chart-grid\" d=\"M{left:.1} {at:.1}H{right:.1}\"/>");
            let name = if self.percent { format!("{:.0} %", 100.0 * value) } else { format!("{value:.2}") };
            svg += &text(left - 8.0, at + 4.0, "end", "chart-small", &name);
        }
        let _ = writeln!(svg, "<path class=\"chart-axis\" d=\"M{left:.1} {top:.1}V{bottom:.1}H{right:.1}\"/>");
        for (value, name) in &scale.ticks {
            svg += &text(x(*value), bottom + 18.0, "middle", "chart-small", name);
        }
        svg += &text(left + PLOT_WIDTH / 2.0, bottom + 38.0, "middle", "", &self.x_label);
        svg += &panel.series.iter().map(|series| line(series, scale, x, y)).collect::<String>();
        if panel.series.len() > 1 {
            let last = |series: &Series| series.points.iter().rev().find(|p| p.value.is_finite()).map(|p| y(p.value));
            let names = panel.series.iter().filter_map(|series| last(series).map(|y| (y, series.name.as_str())));
            svg += &names_at(right + 6.0, names.collect(), bottom);
        }
        svg
    }
}

/// One series in one panel.
fn line(series: &Series, scale: &Scale, x: impl Fn(f64) -> f64, y: impl Fn(f64) -> f64) -> String {
    let points: Vec<&Point> = series.points.iter().filter(|p| scale.holds(p.x) && p.value.is_finite()).collect();
    let way = |ends: &mut dyn Iterator<Item = (f64, f64)>| {
        let ends: Vec<String> = ends.map(|(x, y)| format!("{x:.1} {y:.1}")).collect();
        ends.join("L")
    };
    let mut svg = String::new();
    if points.is_empty() {
        return svg;
    }
    let (color, stroke) = (color(series.look), stroke(series.look));
    if series.dense {
        let upper = points.iter().map(|p| (x(p.x), y(p.interval[1])));
        let lower = points.iter().rev().map(|p| (x(p.x), y(p.interval[0])));
        let around = way(&mut upper.chain(lower));
        let _ = writeln!(svg, "<path class=\"band\" d=\"M{around}z\" fill=\"{color}\" opacity=\"0.15\"/>");
    }
    let _ = writeln!(svg, "<path d=\"M{}\" {stroke}/>", way(&mut points.iter().map(|p| (x(p.x), y(p.value)))));
    let shown = if series.dense { few(&points, scale) } else { points };
    for point in shown {
        let at = x(point.x);
        if !series.dense {
            let [low, high] = point.interval.map(&y);
            let bar = format!("M{at:.1} {low:.1}V{high:.1}M{:.1} {low:.1}h6M{:.1} {high:.1}h6", at - 3.0, at - 3.0);
            let _ = writeln!(svg, "<path class=\"interval\" d=\"{bar}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.5\"/>");
        }
        for single in &point.singles {
            let (cx, cy) = (at + SINGLES_RIGHT, y(*single));
            let _ = writeln!(
                svg,
                "<circle class=\"single\" cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"2\" fill=\"{color}\" opacity=\"0.6\"/>"
            );
        }
        svg += &marker(series.look, at, y(point.value), "mean");
    }
    svg
}

/// Some of many points, about as far from each other along the axis, the last among them.
fn few<'a>(points: &[&'a Point], scale: &Scale) -> Vec<&'a Point> {
    let (first, last) = (scale.share(points[0].x), scale.share(points[points.len() - 1].x));
    let mut shown: Vec<&Point> = Vec::new();
    for point in points {
        let passed = (scale.share(point.x) - first) / (last - first).max(f64::MIN_POSITIVE) * FEW_MARKERS as f64;
        if passed + ROUNDING >= (shown.len() + 1) as f64 {
            shown.push(point);
        }
    }
    if shown.is_empty() { points[points.len() - 1..].to_vec() } else { shown }
}

/// Lowest value that is drawn.
fn lowest(panels: &[Panel]) -> f64 {
    let points = panels.iter().flat_map(|panel| &panel.series).flat_map(|s| &s.points);
    points.flat_map(|p| p.singles.iter().copied().chain([p.value, p.interval[0]])).fold(1.0, f64::min)
}

#[cfg(test)]
#[path = "lines_tests.rs"]
mod tests;
