//! Panels of lines, each with a vertical axis of its own, over parts that are equally wide.

use super::lines::{BOTTOM, COLUMNS, GAP, LEFT, PLOT_WIDTH, RIGHT, TOP};
use super::picture::{Picture, legend, marker, names_at, stroke, text, width_of, width_with};
use super::scale::{Axis, Scale};
use std::fmt::Write;

/// A figure of panels that share their horizontal axis and their legend.
#[derive(Clone, Debug, PartialEq)]
pub struct Panels {
    /// Name of its file without ending.
    pub id: String,
    /// Above everything.
    pub title: String,
    /// The same for who cannot see it.
    pub description: String,
    /// What the horizontal axis is.
    pub note: String,
    /// From the left, three in a row.
    pub panels: Vec<FreePanel>,
}

/// One pair of axes.
#[derive(Clone, Debug, PartialEq)]
pub struct FreePanel {
    /// Above the axes.
    pub title: String,
    /// Whether the vertical axis is logarithmic: then all values are above 0.
    pub log: bool,
    /// Names of the parts of the horizontal axis, each 1 wide, from 0.
    pub parts: Vec<String>,
    /// The lines.
    pub lines: Vec<FreeLine>,
}

/// One line.
#[derive(Clone, Debug, PartialEq)]
pub struct FreeLine {
    /// In the legend and at the line's end.
    pub name: String,
    /// Its colour, marker and dash, below [`super::LOOKS`].
    pub look: usize,
    /// From the left.
    pub points: Vec<[f64; 2]>,
}

// Sizes in pixels, where they are not those of line charts.
const PLOT_HEIGHT: f64 = 170.0;
const BETWEEN: f64 = 62.0;
const UNDER: f64 = 26.0;
/// Markers of a line, by which it is known in grey.
const MARKERS: usize = 4;

impl Panels {
    /// The picture: each line one element of class `curve`.
    pub fn draw(&self) -> Picture {
        let columns = self.panels.len().clamp(1, COLUMNS);
        let rows = self.panels.len().div_ceil(COLUMNS).max(1);
        let names = self.names();
        let ends = if names.len() > 1 { names.iter().map(|(_, name)| width_of(name)).fold(0.0, f64::max) } else { 0.0 };
        let gap = GAP + ends;
        let width = LEFT + columns as f64 * (PLOT_WIDTH + gap) + RIGHT;
        let height = TOP + rows as f64 * (PLOT_HEIGHT + BETWEEN) - BETWEEN + UNDER + BOTTOM;
        let mut svg = text(LEFT, 26.0, "start", "chart-title", &self.title) + &legend(&names, LEFT, 50.0);
        for (i, panel) in self.panels.iter().enumerate() {
            let left = LEFT + (i % COLUMNS) as f64 * (PLOT_WIDTH + gap);
            svg += &panel.draw(left, TOP + (i / COLUMNS) as f64 * (PLOT_HEIGHT + BETWEEN), names.len() > 1);
        }
        svg += &text(LEFT, height - 14.0, "start", "chart-small", &self.note);
        let Panels { id, title, description, .. } = self.clone();
        Picture { id, title, description, size: [width_with(&self.title, LEFT, width), height], body: svg }
    }

    fn names(&self) -> Vec<(usize, &str)> {
        let mut names: Vec<(usize, &str)> = Vec::new();
        for line in self.panels.iter().flat_map(|panel| &panel.lines) {
            if !names.contains(&(line.look, line.name.as_str())) {
                names.push((line.look, &line.name));
            }
        }
        names
    }
}

impl FreePanel {
    fn draw(&self, left: f64, top: f64, several: bool) -> String {
        let values = || self.lines.iter().flat_map(|line| &line.points).map(|point| point[1]);
        let scale = if self.log { Scale::over(&Axis::Log, values()) } else { Scale::between(values()) };
        let y = |value: f64| top + PLOT_HEIGHT * (1.0 - scale.share(value));
        let width = PLOT_WIDTH / self.parts.len().max(1) as f64;
        let x = |place: f64| left + width * place;
        let (bottom, right) = (top + PLOT_HEIGHT, left + PLOT_WIDTH);
        let title = if self.log { format!("{} (log)", self.title) } else { self.title.clone() };
        let mut svg = text(left + PLOT_WIDTH / 2.0, top - 10.0, "middle", "", &title);
        for (value, name) in &scale.ticks {
            let at = y(*value);
            let _ = writeln!(svg, "<path class=\"chart-grid\" d=\"M{left:.1} {at:.1}H{right:.1}\"/>");
            svg += &text(left - 8.0, at + 4.0, "end", "chart-small", name);
        }
        for (at, name) in self.parts.iter().enumerate() {
            if at > 0 {
                let _ = writeln!(svg, "<path class=\"chart-grid\" d=\"M{:.1} {top:.1}V{bottom:.1}\"/>", x(at as f64));
            }
            svg += &text(x(at as f64 + 0.5), bottom + 18.0, "middle", "chart-small", name);
        }
        let _ = writeln!(svg, "<path class=\"chart-axis\" d=\"M{left:.1} {top:.1}V{bottom:.1}H{right:.1}\"/>");
        for line in &self.lines {
            svg += &line.draw(x, y, width);
        }
        if several {
            let ends = self.lines.iter().filter_map(|line| line.points.last().map(|point| (y(point[1]), line.name.as_str())));
            svg += &names_at(right + 6.0, ends.collect(), bottom);
        }
        svg
    }
}

impl FreeLine {
    fn draw(&self, x: impl Fn(f64) -> f64, y: impl Fn(f64) -> f64, width: f64) -> String {
        // As many columns in a part as it has pixels.
        let shown = thinned(&self.points, width);
        let way: Vec<String> = shown.iter().map(|point| format!("{:.1} {:.1}", x(point[0]), y(point[1]))).collect();
        let mut svg = format!("<path class=\"curve\" d=\"M{}\" {}/>\n", way.join("L"), stroke(self.look));
        let step = shown.len().div_ceil(MARKERS).max(1);
        for point in shown.iter().rev().step_by(step) {
            svg += &marker(self.look, x(point[0]), y(point[1]), "mean");
        }
        svg
    }
}

/// At most the lowest and the highest point of each of so many columns in a part of the axis.
fn thinned(points: &[[f64; 2]], columns: f64) -> Vec<[f64; 2]> {
    let column = |point: &[f64; 2]| (point[0] * columns).floor();
    let mut shown = Vec::new();
    for group in points.chunk_by(|a, b| column(a) == column(b)) {
        let by = |a: &&[f64; 2], b: &&[f64; 2]| a[1].total_cmp(&b[1]);
        let ends = [group.iter().min_by(by), group.iter().max_by(by)];
        let mut ends: Vec<[f64; 2]> = ends.into_iter().flatten().copied().collect();
        ends.sort_by(|a, b| a[0].total_cmp(&b[0]));
        ends.dedup();
        shown.extend(ends);
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_panel_has_its_own_axis_and_every_line_is_drawn_inside() {
        let line = |name: &str, look, scale: f64| FreeLine {
            name: name.into(),
            look,
            points: (1..=2000).map(|i| [f64::from(i) / 1000.0, scale * f64::from(i % 7 + 1)]).collect(),
        };
        let panel = |title: &str, scale: f64, log| FreePanel {
            title: title.into(),
            log,
            parts: vec!["warm-start 1000".into(), "hil 1000".into()],
            lines: vec![line("a<b", 0, scale), line("c", 1, scale)],
        };
        let panels = Panels {
            id: "curves".into(),
            title: "curves".into(),
            description: "two panels".into(),
            note: String::new(),
            panels: vec![panel("small", 1e-5, true), panel("below zero", -10.0, false)],
        };
        let svg = panels.draw().to_svg();
        let document = roxmltree::Document::parse(&svg).expect("XML");
        let of = |class: &str| document.descendants().filter(|n| n.attribute("class") == Some(class)).collect::<Vec<_>>();
        assert_eq!((of("curve").len(), of("key").len()), (4, 2));
        let words: Vec<&str> = document.descendants().filter_map(|n| n.text()).collect();
        for word in ["small (log)", "below zero", "a<b", "1e-5", "5e-5", "-70", "-10", "warm-start 1000"] {
            assert!(words.contains(&word), "{word} is not written in {words:?}");
        }
        for curve in of("curve") {
            let way = curve.attribute("d").expect("a way");
            let heights =
                way[1..].split('L').map(|point| point.split_once(' ').and_then(|(_, y)| y.parse::<f64>().ok()).expect("a point"));
            assert!(heights.into_iter().all(|y| (TOP..=TOP + PLOT_HEIGHT).contains(&y)));
        }
        assert!(svg.len() < 100_000, "{} bytes", svg.len());
    }
}
