//! Curves on a terminal: dots of braille, or plain characters where the terminal has no others or colours do not tell the curves apart.

use super::model::Plot;
use crate::math::log10;
use crate::report::chart::tick;
use std::collections::BTreeMap;

/// How to draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Style {
    /// Characters of a line.
    pub width: usize,
    /// Lines of a plot, without title and axis.
    pub height: usize,
    /// Whether the terminal shows colours.
    pub colour: bool,
    /// Whether it shows more than ASCII.
    pub unicode: bool,
}

/// Characters of plots side by side, at least.
const PLOT: usize = 56;
/// Blanks between them.
const BETWEEN: usize = 2;
/// Characters of the numbers at the vertical axis.
const NUMBERS: usize = 8;
/// Marks of curves where colours do not tell them apart.
const MARKS: [char; 6] = ['*', 'o', '+', 'x', '#', '@'];
/// Colours of curves, by their numbers in the palette of 256: those of the pictures, as near as it has them.
const COLOURS: [u8; 6] = [32, 166, 35, 175, 178, 74];
/// Dots of a character of braille, side by side and one below the other.
const DOTS: [usize; 2] = [2, 4];
/// The empty character of braille, and the bit of each dot by its row, left and right.
const BRAILLE: u32 = 0x2800;
const BITS: [[u32; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];

/// How many of so many plots stand side by side.
pub fn columns(width: usize, plots: usize) -> usize {
    ((width + BETWEEN) / (PLOT + BETWEEN)).clamp(1, plots.max(1))
}

/// All plots, as many side by side as fit.
pub fn draw(plots: &[Plot], style: &Style) -> String {
    let columns = columns(style.width, plots.len());
    let width = (style.width + BETWEEN) / columns - BETWEEN;
    let marked = marked(plots, style);
    let mut text = legend(plots, marked, style);
    for row in plots.chunks(columns) {
        let blocks: Vec<Vec<(String, usize)>> = row.iter().map(|plot| block(plot, width, marked, style)).collect();
        let lines = blocks.iter().map(Vec::len).max().unwrap_or(0);
        for line in 0..lines {
            let mut whole = String::new();
            for (at, block) in blocks.iter().enumerate() {
                let (cell, shown) = block.get(line).cloned().unwrap_or_default();
                whole += &cell;
                if at + 1 < blocks.len() {
                    whole += &" ".repeat((width + BETWEEN).saturating_sub(shown));
                }
            }
            text += &format!("{}\n", whole.trim_end());
        }
    }
    text
}

/// Whether curves need marks: several in a plot, and no colours.
fn marked(plots: &[Plot], style: &Style) -> bool {
    !style.unicode || (!style.colour && plots.iter().any(|plot| plot.curves.len() > 1))
}

fn legend(plots: &[Plot], marked: bool, style: &Style) -> String {
    let names: BTreeMap<usize, &str> = plots.iter().flat_map(|plot| &plot.curves).map(|c| (c.source, c.name.as_str())).collect();
    let entry = |(source, name): (&usize, &&str)| {
        let mark = if marked { MARKS[source % MARKS.len()] } else { '\u{2500}' };
        painted(&mark.to_string(), *source, style) + " " + name
    };
    let entries: Vec<String> = names.iter().map(entry).collect();
    let mut text = String::new();
    let mut used = 0;
    for (entry, name) in entries.iter().zip(names.values()) {
        let shown = 2 + name.chars().count();
        if used > 0 && used + 3 + shown > style.width {
            text += "\n";
            used = 0;
        } else if used > 0 {
            text += "   ";
            used += 3;
        }
        text += entry;
        used += shown;
    }
    if text.is_empty() { text } else { text + "\n" }
}

/// Text in the colour of a curve.
pub(super) fn painted(text: &str, source: usize, style: &Style) -> String {
    if !style.colour {
        return text.into();
    }
    format!("\u{1b}[38;5;{}m{text}\u{1b}[0m", COLOURS[source % COLOURS.len()])
}

/// A plot's lines, each with the characters that it takes.
fn block(plot: &Plot, width: usize, marked: bool, style: &Style) -> Vec<(String, usize)> {
    let (low, high) = ends(plot);
    let inner = width.saturating_sub(NUMBERS + 2).max(1);
    let height = style.height.max(2);
    let whole = |text: String| {
        let cut: String = text.chars().take(width).collect();
        let shown = cut.chars().count();
        (cut, shown)
    };
    let title = if plot.log { format!("{} (log)", plot.metric) } else { plot.metric.clone() };
    let title = if plot.doc.is_empty() { title } else { format!("{title}: {}", plot.doc) };
    let mut lines = vec![whole(title)];
    let canvas = Canvas::of(plot, [inner, height], [low, high], (marked, style));
    for (row, cells) in canvas.rows().into_iter().enumerate() {
        let value = match row {
            0 => tick(raised(plot, high)),
            row if row + 1 == height => tick(raised(plot, low)),
            _ => String::new(),
        };
        let bar = if style.unicode { "\u{2502}" } else { "|" };
        lines.push((format!("{value:>NUMBERS$} {bar}{cells}"), NUMBERS + 2 + inner));
    }
    let [corner, dash] = if style.unicode { ["\u{2514}", "\u{2500}"] } else { ["+", "-"] };
    lines.push((format!("{}{corner}{}", " ".repeat(NUMBERS + 1), dash.repeat(inner)), NUMBERS + 2 + inner));
    lines.push(whole(" ".repeat(NUMBERS + 2) + &stages(plot, inner)));
    lines
}

/// Names of the stages below the parts of the axis.
fn stages(plot: &Plot, inner: usize) -> String {
    let part = inner / plot.stages.len().max(1);
    let name = |name: &String| {
        // Without its epochs where they do not fit: half of a number is another one.
        let fits = name.chars().count() < part;
        let name = if fits { name } else { name.rsplit_once(' ').map_or(name.as_str(), |(name, _)| name) };
        let cut: String = name.chars().take(part.saturating_sub(1)).collect();
        format!("{cut:<part$}")
    };
    plot.stages.iter().map(name).collect::<String>().trim_end().to_string()
}

/// A value on the axis.
fn along(plot: &Plot, value: f64) -> f64 {
    if plot.log { log10(value) } else { value }
}

/// The value of a place on it.
fn raised(plot: &Plot, place: f64) -> f64 {
    if plot.log { crate::math::pow(10.0, place) } else { place }
}

fn ends(plot: &Plot) -> (f64, f64) {
    let [low, high] = plot.range.map(|value| along(plot, value));
    // A value that does not change lies in the middle.
    if high > low { (low, high) } else { (low - low.abs().max(1.0) / 2.0, high + high.abs().max(1.0) / 2.0) }
}

/// Dots by character: which curve's they are, and the braille that they make.
struct Canvas<'a> {
    size: [usize; 2],
    cells: Vec<Option<(usize, u32)>>,
    marked: bool,
    style: &'a Style,
}

impl<'a> Canvas<'a> {
    fn of(plot: &Plot, size: [usize; 2], [low, high]: [f64; 2], (marked, style): (bool, &'a Style)) -> Self {
        let mut canvas = Canvas { size, cells: vec![None; size[0] * size[1]], marked, style };
        let dots = if marked { size } else { [size[0] * DOTS[0], size[1] * DOTS[1]] };
        let parts = plot.stages.len().max(1) as f64;
        let place = |point: &[f64; 2]| {
            let x = (point[0] / parts * dots[0] as f64).ceil() as usize;
            let y = (high - along(plot, point[1])) / (high - low) * (dots[1] - 1) as f64;
            (x.clamp(1, dots[0]) - 1, (y.round().max(0.0) as usize).min(dots[1] - 1))
        };
        // The first is drawn last, over the others.
        for curve in plot.curves.iter().rev() {
            let mut before: Option<(usize, usize)> = None;
            for (x, y) in curve.points.iter().map(place) {
                let (left, from) = before.unwrap_or((x, y));
                for step in 0..=(x - left.min(x)) {
                    // Straight to the next point, so that few points make a line too.
                    let share = |s: usize| s as f64 / (x - left).max(1) as f64;
                    let height = |s: usize| (from as f64 + (y as f64 - from as f64) * share(s)).round() as usize;
                    let (a, b) = if x == left { (from, y) } else { (height(step.saturating_sub(1)), height(step)) };
                    (a.min(b)..=a.max(b)).for_each(|at| canvas.dot(left + step, at, curve.source));
                }
                before = Some((x, y));
            }
        }
        canvas
    }

    fn dot(&mut self, x: usize, y: usize, source: usize) {
        let ([columns, rows], bit) =
            if self.marked { ([x, y], 1) } else { ([x / DOTS[0], y / DOTS[1]], BITS[y % DOTS[1]][x % DOTS[0]]) };
        let cell = &mut self.cells[rows * self.size[0] + columns];
        let others = cell.filter(|(owner, _)| *owner == source || !self.marked).map_or(0, |(_, bits)| bits);
        *cell = Some((source, others | bit));
    }

    fn rows(&self) -> Vec<String> {
        let character = |(source, bits): (usize, u32)| {
            let mark = MARKS[source % MARKS.len()];
            let shown = if self.marked { mark } else { char::from_u32(BRAILLE + bits).unwrap_or(mark) };
            painted(&shown.to_string(), source, self.style)
        };
        let row =
            |cells: &[Option<(usize, u32)>]| cells.iter().map(|cell| cell.map_or(" ".into(), character)).collect::<String>();
        self.cells.chunks(self.size[0]).map(row).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::model::{plots, tests::source};
    use super::*;

    const PLAIN: Style = Style { width: 40, height: 5, colour: false, unicode: false };

    #[test]
    fn a_straight_line_is_one_and_no_line_is_longer_than_the_terminal() {
        let found = plots(&[source("hil", &[("hil", 20)], |x| x)], &[]).expect("plots");
        let text = draw(&found, &PLAIN);
        let rows: Vec<&str> = text.lines().collect();
        assert_eq!(rows[0], "* hil");
        assert_eq!(rows[1], "l_bc: L_BC");
        assert!(rows[2].starts_with("      19 |") && rows[2].ends_with("****"), "{text}");
        assert!(rows[6].starts_with("       0 | ***"), "{text}");
        assert_eq!(rows[8].trim(), "hil 20");
        for width in [20, 40, 80, 200] {
            let text = draw(&found, &Style { width, ..PLAIN });
            assert!(text.is_ascii() && text.lines().all(|line| line.len() <= width), "{width}: {text}");
        }
    }

    #[test]
    fn braille_has_the_dots_of_the_points_and_colours_or_marks_tell_curves_apart() {
        let two = [source("a", &[("hil", 60)], |_| 1.0), source("b", &[("hil", 60)], |_| 2.0)];
        let found = plots(&two, &[]).expect("plots");
        let marks = draw(&found, &Style { unicode: true, ..PLAIN });
        assert!(marks.contains("* a   o b") && marks.contains("ooooo") && marks.contains("*****"), "{marks}");
        let colours = draw(&found, &Style { unicode: true, colour: true, ..PLAIN });
        // The dots of the highest and of the lowest row.
        assert!(
            colours.contains("\u{1b}[38;5;166m\u{2809}\u{1b}[0m") && colours.contains("\u{1b}[38;5;32m\u{28c0}\u{1b}[0m"),
            "{colours}"
        );
    }
}
