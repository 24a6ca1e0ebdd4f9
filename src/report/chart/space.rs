//! Paths in space, drawn in parallel projection: panels side by side with the same box, so that they compare at sight.

use super::picture::{Picture, color, marker, stroke, text, width_with};
use crate::math;
use std::fmt::Write;

/// A figure of panels with paths.
#[derive(Clone, Debug, PartialEq)]
pub struct Space {
    /// Name of its file without ending.
    pub id: String,
    /// Above everything.
    pub title: String,
    /// The same for who cannot see it.
    pub description: String,
    /// What lines and marks mean.
    pub note: String,
    /// From the left, three in a row.
    pub panels: Vec<Site>,
}

/// One panel.
#[derive(Clone, Debug, PartialEq)]
pub struct Site {
    /// Above it.
    pub title: String,
    /// Its paths.
    pub paths: Vec<Path>,
}

/// One path.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// The number behind I (initial) and G (where it ends); it has a look of its own too.
    pub number: usize,
    /// Points x, y, z \[m\].
    pub points: Vec<[f64; 3]>,
    /// Where it was to end \[m\].
    pub target: [f64; 3],
}

// Sizes in pixels.
const SIDE: f64 = 320.0;
const LEFT: f64 = 24.0;
const GAP: f64 = 24.0;
const TOP: f64 = 84.0;
const UNDER: f64 = 44.0;
const BOTTOM: f64 = 30.0;
const COLUMNS: usize = 3;
/// From where one looks: about the vertical, and down \[rad\].
const AZIMUTH_RAD: f64 = 0.9;
const ELEVATION_RAD: f64 = 0.45;
/// The box ends at multiples of this \[m\].
const STEP_M: f64 = 0.1;
/// And is no narrower \[m\].
const LEAST_M: f64 = 0.2;

/// Points of the world on paper, to the right and up \[m\].
fn project([x, y, z]: [f64; 3]) -> [f64; 2] {
    let ((sin_a, cos_a), (sin_e, cos_e)) = (math::sin_cos(AZIMUTH_RAD), math::sin_cos(ELEVATION_RAD));
    let (right, away) = (-sin_a * x + cos_a * y, cos_a * x + sin_a * y);
    [right, z * cos_e + away * sin_e]
}

impl Space {
    /// The picture. Each path is one element of class `path`.
    pub fn draw(&self) -> Picture {
        let bounds = self.bounds();
        let columns = self.panels.len().clamp(1, COLUMNS) as f64;
        let rows = self.panels.len().div_ceil(COLUMNS).max(1) as f64;
        let size = [LEFT * 2.0 + columns * (SIDE + GAP) - GAP, TOP + rows * (SIDE + UNDER) - UNDER + BOTTOM + UNDER];
        let mut svg = text(LEFT, 26.0, "start", "chart-title", &self.title);
        for (i, panel) in self.panels.iter().enumerate() {
            let left = LEFT + (i % COLUMNS) as f64 * (SIDE + GAP);
            let top = TOP + (i / COLUMNS) as f64 * (SIDE + UNDER);
            svg += &text(left + SIDE / 2.0, top - 12.0, "middle", "", &panel.title);
            let paper = Paper::over(&bounds, left, top);
            svg += &paper.frame(&bounds);
            svg += &panel.paths.iter().map(|path| paper.path(path)).collect::<String>();
        }
        svg += &text(LEFT, size[1] - 14.0, "start", "chart-small", &self.note);
        let Space { id, title, description, .. } = self.clone();
        Picture { id, title, description, size: [width_with(&self.title, LEFT, size[0]), size[1]], body: svg }
    }

    /// Low and high ends along x, y and z \[m\], with room for every point.
    fn bounds(&self) -> [[f64; 2]; 3] {
        let paths = || self.panels.iter().flat_map(|panel| &panel.paths);
        let points =
            || paths().flat_map(|path| path.points.iter().chain([&path.target])).filter(|p| p.iter().all(|v| v.is_finite()));
        [0, 1, 2].map(|axis| {
            let [low, high] = points().fold([f64::MAX, f64::MIN], |[low, high], p| [low.min(p[axis]), high.max(p[axis])]);
            let [low, high] = if low > high { [0.0, 1.0] } else { [low, high] };
            let low = if axis == 2 { low.min(0.0) } else { low };
            let (low, high) = ((low / STEP_M).floor() * STEP_M, ((high / STEP_M).floor() + 1.0) * STEP_M);
            [low, high.max(low + LEAST_M)]
        })
    }
}

/// From the world to one panel.
struct Paper {
    origin: [f64; 2],
    scale: f64,
    low: [f64; 2],
}

impl Paper {
    fn over(bounds: &[[f64; 2]; 3], left: f64, top: f64) -> Self {
        let corners: Vec<[f64; 2]> = (0..8).map(|c| project([0, 1, 2].map(|axis| bounds[axis][c >> axis & 1]))).collect();
        let ends = |i: usize| corners.iter().fold([f64::MAX, f64::MIN], |[low, high], c| [low.min(c[i]), high.max(c[i])]);
        let (across, up) = (ends(0), ends(1));
        let scale = SIDE / (across[1] - across[0]).max(up[1] - up[0]);
        let spare = (SIDE - scale * (across[1] - across[0])) / 2.0;
        Paper { origin: [left + spare, top + SIDE], scale, low: [across[0], up[0]] }
    }

    fn at(&self, point: [f64; 3]) -> [f64; 2] {
        let [right, up] = project(point);
        [self.origin[0] + self.scale * (right - self.low[0]), self.origin[1] - self.scale * (up - self.low[1])]
    }

    fn way(&self, points: &[[f64; 3]]) -> String {
        let ends: Vec<String> = points.iter().map(|p| self.at(*p)).map(|[x, y]| format!("{x:.1} {y:.1}")).collect();
        format!("M{}", ends.join("L"))
    }

    /// The table below, the far edge upwards, and their lengths.
    fn frame(&self, [x, y, z]: &[[f64; 2]; 3]) -> String {
        let mut svg = String::new();
        let steps = |ends: &[f64; 2]| {
            let (low, count) = (ends[0], ((ends[1] - ends[0]) / STEP_M).round() as u32);
            (0..=count).map(move |i| low + f64::from(i) * STEP_M)
        };
        let mut grid = |points: &[[f64; 3]]| {
            let _ = writeln!(svg, "<path class=\"chart-grid\" d=\"{}\"/>", self.way(points));
        };
        steps(x).for_each(|x| grid(&[[x, y[0], z[0]], [x, y[1], z[0]]]));
        steps(y).for_each(|y| grid(&[[x[0], y, z[0]], [x[1], y, z[0]]]));
        steps(z).for_each(|z| grid(&[[x[1], y[0], z], [x[1], y[1], z]]));
        for y in y {
            grid(&[[x[1], *y, z[0]], [x[1], *y, z[1]]]);
        }
        for z in steps(z) {
            let [px, py] = self.at([x[1], y[0], z]);
            svg += &text(px - 6.0, py + 4.0, "end", "chart-small", &format!("{z:.1}"));
        }
        let names = [
            ("x", [(x[0] + x[1]) / 2.0, y[1], z[0]], x[1] - x[0], [14.0, 12.0]),
            ("y", [x[0], (y[0] + y[1]) / 2.0, z[0]], y[1] - y[0], [-14.0, 18.0]),
        ];
        for (name, point, length, [dx, dy]) in names {
            let [px, py] = self.at(point);
            svg += &text(px + dx, py + dy, "middle", "chart-small", &format!("{name}, {length:.1} m"));
        }
        let [px, py] = self.at([x[1], y[0], z[1]]);
        svg + &text(px, py - 8.0, "middle", "chart-small", "z, m")
    }

    fn path(&self, path: &Path) -> String {
        let (Some(first), Some(last)) = (path.points.first(), path.points.last()) else { return String::new() };
        let (look, number) = (path.number - 1, path.number);
        let ([ix, iy], [gx, gy], [tx, ty]) = (self.at(*first), self.at(*last), self.at(path.target));
        let (color, mut svg) = (color(look), String::new());
        // A plumb line from the end to the table says how high it is.
        let plumb = self.way(&[*last, [last[0], last[1], 0.0]]);
        let _ = writeln!(svg, "<path class=\"chart-grid\" d=\"{plumb}\" stroke-dasharray=\"1 3\"/>");
        let _ = writeln!(svg, "<path class=\"path\" d=\"{}\" {}/>", self.way(&path.points), stroke(look));
        let _ = writeln!(
            svg,
            "<circle class=\"target\" cx=\"{tx:.1}\" cy=\"{ty:.1}\" r=\"7\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.5\"/>"
        );
        svg += &marker(look, gx, gy, "end");
        let _ = writeln!(svg, "<circle class=\"start\" cx=\"{ix:.1}\" cy=\"{iy:.1}\" r=\"3\" fill=\"{color}\"/>");
        svg += &text(ix + 6.0, iy + 14.0, "start", "chart-small", &format!("I{number}"));
        svg + &text(gx + 10.0, gy - 4.0, "start", "chart-small", &format!("G{number}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_higher_or_farther_stands_higher_and_all_is_inside_the_panel() {
        let points = vec![[0.4, -0.1, 0.025], [0.41, -0.1, 0.1], [0.4, -0.1, 0.2]];
        let path = Path { number: 1, points, target: [0.4, -0.1, 0.2] };
        let panel = |title: &str| Site { title: title.into(), paths: vec![path.clone()] };
        let space = Space {
            id: "space".into(),
            title: "paths".into(),
            description: "one path".into(),
            note: String::new(),
            panels: vec![panel("hil"), panel("bc")],
        };
        let bounds = space.bounds();
        assert!(bounds[2][0] == 0.0 && bounds[2][1] > 0.2, "{bounds:?}");
        let paper = Paper::over(&bounds, 0.0, 0.0);
        let [low, high] = [paper.at(path.points[0]), paper.at(path.points[2])];
        assert!((low[0] - high[0]).abs() < 1e-9 && high[1] < low[1] && project([1.0, 0.0, 0.0])[1] > 0.0);
        assert!([low, high].iter().flatten().all(|v| (0.0..=SIDE).contains(v)), "{low:?} {high:?}");
        let svg = space.draw().to_svg();
        let document = roxmltree::Document::parse(&svg).expect("XML");
        assert_eq!(document.descendants().filter(|n| n.attribute("class") == Some("path")).count(), 2);
    }
}
