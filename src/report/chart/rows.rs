//! Values beside names: a row a name, panels side by side, in each the same rows with values, intervals and single observations from left to right.

use super::picture::{Picture, color, legend, marker, text, width_of, width_with};
use std::fmt::Write;

/// A figure of shares between 0 and 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Rows {
    /// Name of its file without ending.
    pub id: String,
    /// Above everything.
    pub title: String,
    /// The same for who cannot see it.
    pub description: String,
    /// Under each panel.
    pub x_label: String,
    /// What markers, bars and dots mean.
    pub note: String,
    /// Titles of the panels, from the left.
    pub panels: Vec<String>,
    /// From the top.
    pub rows: Vec<Row>,
}

/// One name and what stands beside it.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The name.
    pub name: String,
    /// In any order.
    pub data: Vec<Datum>,
}

/// One value.
#[derive(Clone, Debug, PartialEq)]
pub struct Datum {
    /// Index of its panel.
    pub panel: usize,
    /// Colour and marker, below [`super::LOOKS`].
    pub look: usize,
    /// In the legend, where there are several.
    pub series: String,
    /// The value.
    pub value: f64,
    /// Its interval, low and high.
    pub interval: [f64; 2],
    /// The observations that the value pools.
    pub singles: Vec<f64>,
}

// Sizes in pixels.
const PLOT_WIDTH: f64 = 250.0;
const GAP: f64 = 52.0;
const LEFT: f64 = 24.0;
const RIGHT: f64 = 28.0;
const TOP: f64 = 92.0;
const BOTTOM: f64 = 74.0;
/// From the names to the first panel.
const NAMES: f64 = 16.0;
/// Height of a row beside that of its series.
const ROW: f64 = 14.0;
/// Height of a series within a row.
const SERIES: f64 = 14.0;
/// Steps of the axis.
const TICKS: u32 = 5;

impl Rows {
    /// The picture. Each value is one element of class `mean`, each observation one of class `single`.
    pub fn draw(&self) -> Picture {
        let series = self.series();
        let names = self.rows.iter().map(|row| width_of(&row.name)).fold(0.0, f64::max);
        let left = LEFT + names + NAMES;
        let width = left + self.panels.len() as f64 * (PLOT_WIDTH + GAP) - GAP + RIGHT;
        let row_height = ROW + SERIES * series.len().max(1) as f64;
        let bottom = TOP + row_height * self.rows.len() as f64;
        let height = bottom + BOTTOM;
        let mut svg = text(LEFT, 26.0, "start", "chart-title", &self.title);
        if series.len() > 1 {
            svg += &legend(&series, LEFT, 50.0);
        }
        for (i, title) in self.panels.iter().enumerate() {
            svg += &self.axes(title, left + i as f64 * (PLOT_WIDTH + GAP), bottom);
        }
        for (i, row) in self.rows.iter().enumerate() {
            let top = TOP + row_height * i as f64;
            svg += &text(left - NAMES, top + row_height / 2.0 + 4.0, "end", "", &row.name);
            for datum in &row.data {
                let at =
                    series.iter().position(|(look, name)| (*look, *name) == (datum.look, datum.series.as_str())).unwrap_or(0);
                let y = top + ROW / 2.0 + SERIES * (at as f64 + 0.5);
                svg += &draw(datum, left + datum.panel as f64 * (PLOT_WIDTH + GAP), y);
            }
        }
        svg += &text(LEFT, height - 14.0, "start", "chart-small", &self.note);
        let Rows { id, title, description, .. } = self.clone();
        Picture { id, title, description, size: [width_with(&self.title, LEFT, width), height], body: svg }
    }

    /// Looks and names, in the order in which they first come.
    fn series(&self) -> Vec<(usize, &str)> {
        let mut seen = Vec::new();
        for datum in self.rows.iter().flat_map(|row| &row.data) {
            let one = (datum.look, datum.series.as_str());
            if !seen.contains(&one) {
                seen.push(one);
            }
        }
        seen.sort_unstable();
        seen
    }

    fn axes(&self, title: &str, left: f64, bottom: f64) -> String {
        let mut svg = text(left + PLOT_WIDTH / 2.0, TOP - 10.0, "middle", "", title);
        for tick in 0..=TICKS {
            let share = f64::from(tick) / f64::from(TICKS);
            let x = left + PLOT_WIDTH * share;
            let _ = writeln!(svg, "<path class=\"chart-grid\" d=\"M{x:.1} {TOP:.1}V{bottom:.1}\"/>");
            svg += &text(x, bottom + 18.0, "middle", "chart-small", &format!("{:.0} %", 100.0 * share));
        }
        let _ = writeln!(svg, "<path class=\"chart-axis\" d=\"M{left:.1} {TOP:.1}V{bottom:.1}H{:.1}\"/>", left + PLOT_WIDTH);
        svg + &text(left + PLOT_WIDTH / 2.0, bottom + 38.0, "middle", "", &self.x_label)
    }
}

fn draw(datum: &Datum, left: f64, y: f64) -> String {
    let x = |share: f64| left + PLOT_WIDTH * share.clamp(0.0, 1.0);
    let (color, [low, high]) = (color(datum.look), datum.interval.map(x));
    let mut svg = String::new();
    for single in &datum.singles {
        let cx = x(*single);
        let _ = writeln!(svg, "<circle class=\"single\" cx=\"{cx:.1}\" cy=\"{y:.1}\" r=\"2\" fill=\"{color}\" opacity=\"0.5\"/>");
    }
    let bar = format!("M{low:.1} {y:.1}H{high:.1}M{low:.1} {:.1}v6M{high:.1} {:.1}v6", y - 3.0, y - 3.0);
    let _ = writeln!(svg, "<path class=\"interval\" d=\"{bar}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.5\"/>");
    svg + &marker(datum.look, x(datum.value), y, "mean")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_stands_in_its_row_and_panel() {
        let datum = |panel, look, value: f64| Datum {
            panel,
            look,
            series: ["hil", "bc"][look].into(),
            value,
            interval: [value - 0.1, value],
            singles: vec![value; 3],
        };
        let row = |name: &str, value| Row { name: name.into(), data: vec![datum(0, 0, value), datum(1, 1, value)] };
        let rows = Rows {
            id: "rows".into(),
            title: "Success".into(),
            description: "two rows".into(),
            x_label: "success".into(),
            note: "note".into(),
            panels: vec!["pick-up".into(), "stack".into()],
            rows: vec![row("first", 0.5), row("second", 1.0)],
        };
        let svg = rows.draw().to_svg();
        let document = roxmltree::Document::parse(&svg).expect("XML");
        let count = |class: &str| document.descendants().filter(|n| n.attribute("class") == Some(class)).count();
        assert_eq!((count("mean"), count("interval"), count("single"), count("key")), (4, 4, 12, 2));
        let dots = document.descendants().filter(|n| n.attribute("class") == Some("single"));
        let at = |n: roxmltree::Node, axis| n.attribute(axis).and_then(|v| v.parse::<f64>().ok()).expect("a place");
        let dots: Vec<[f64; 2]> = dots.map(|n| [at(n, "cx"), at(n, "cy")]).collect();
        assert!(dots[6][0] > dots[0][0] && dots[6][1] > dots[0][1] && dots[3][0] > dots[0][0], "{dots:?}");
    }
}
