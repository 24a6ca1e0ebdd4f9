//! The colours of everything, and the fixed palette of animated pictures.

use super::raster::Rgb;
use crate::task::Task;

/// Behind everything.
pub const BACKGROUND: Rgb = [246, 247, 249];
/// The table.
pub const TABLE: Rgb = [226, 221, 212];
/// Objects that goals move: orange, yellow, violet.
pub const MOVED: [Rgb; 3] = [[245, 134, 32], [222, 184, 46], [146, 92, 182]];
/// The other objects.
pub const BASE: Rgb = [52, 116, 205];
/// The target.
pub const TARGET: Rgb = [48, 172, 92];
/// Boxes to keep clear of.
pub const OBSTACLE: Rgb = [176, 104, 112];
/// Labels.
pub const TEXT: Rgb = [52, 58, 68];
/// The label of a solved episode.
pub const GOOD: Rgb = [20, 128, 62];
/// The label of a failed episode.
pub const BAD: Rgb = [196, 44, 44];
/// The arm, from base to fingers: neighbours differ so that joints can be told apart.
const ARM: [Rgb; 4] = [[82, 90, 108], [150, 160, 176], [108, 118, 136], [86, 96, 118]];

/// Colour of an object of a task.
pub fn of_object(task: &Task, object: usize) -> Rgb {
    if object < task.moved() { MOVED[object % MOVED.len()] } else { BASE }
}

/// Colour of a link of a robot, whose arm has so many joints.
pub fn of_link(link: usize, arm: usize) -> Rgb {
    match link {
        0 => ARM[0],
        link if link == arm => ARM[3],
        link if link < arm && link % 2 == 1 => ARM[1],
        _ => ARM[2],
    }
}

/// Palette index of "as in the picture before".
pub const UNCHANGED: u8 = 255;
/// Colours whose shades are in the palette, as many as it has room for; those of others come from the coarse cube.
const SHADED: [Rgb; 9] = [TABLE, MOVED[0], BASE, TARGET, OBSTACLE, ARM[0], ARM[1], ARM[2], ARM[3]];
/// Shades of each of them, evenly from darkest to brightest.
const SHADES: usize = 14;
/// Brightness of the darkest and the brightest shade: what shading and shadow can make of a colour.
const BRIGHTNESS: [f32; 2] = [0.42, 1.10];
/// Steps per channel of the coarse cube that catches mixtures at edges.
const CUBE: usize = 5;
/// Bits per channel that decide a pixel's palette entry.
const BITS: u32 = 6;

/// The palette and what has been looked up in it so far.
pub struct Palette {
    colors: Vec<Rgb>,
    found: Vec<Option<u8>>,
}

impl Palette {
    /// Exact entries for the flat colours, shades of the materials, and a coarse cube of all colours.
    pub fn new() -> Self {
        let mut colors = vec![BACKGROUND, TEXT, GOOD, BAD];
        for rgb in SHADED {
            for step in 0..SHADES {
                let brightness = BRIGHTNESS[0] + (BRIGHTNESS[1] - BRIGHTNESS[0]) * step as f32 / (SHADES - 1) as f32;
                colors.push(rgb.map(|v| (f32::from(v) * brightness).min(255.0) as u8));
            }
        }
        let level = |i: usize| (i * 255 / (CUBE - 1)) as u8;
        colors.extend((0..CUBE.pow(3)).map(|i| [level(i / CUBE.pow(2)), level(i / CUBE % CUBE), level(i % CUBE)]));
        debug_assert!(colors.len() <= usize::from(UNCHANGED), "{} colours leave no room for the unchanged entry", colors.len());
        Palette { colors, found: vec![None; 1 << (3 * BITS)] }
    }

    /// All entries as bytes, 256 of them.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes: Vec<u8> = self.colors.iter().flatten().copied().collect();
        bytes.resize(256 * 3, 0);
        bytes
    }

    /// Index of the nearest entry.
    pub fn index(&mut self, rgb: Rgb) -> u8 {
        let key = rgb.iter().fold(0, |key, v| (key << BITS) | usize::from(v >> (8 - BITS)));
        if let Some(index) = self.found[key] {
            return index;
        }
        // The middle of the cell, so that the answer does not depend on which of its colours came first.
        let middle = rgb.map(|v| i32::from((v >> (8 - BITS)) << (8 - BITS)) + (1 << (7 - BITS)));
        // The eye tells green apart best, then red.
        let distance = |c: &Rgb| -> i32 { (0..3).map(|i| [3, 4, 2][i] * (middle[i] - i32::from(c[i])).pow(2)).sum() };
        let nearest = (0..self.colors.len()).min_by_key(|i| distance(&self.colors[*i])).unwrap_or(0) as u8;
        self.found[key] = Some(nearest);
        nearest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_palette_fits_and_keeps_the_scenes_colours() {
        let mut palette = Palette::new();
        assert!(palette.colors.len() <= usize::from(UNCHANGED));
        assert_eq!(palette.bytes().len(), 768);
        for rgb in SHADED.into_iter().chain([BACKGROUND, TEXT, GOOD, BAD]) {
            let index = palette.index(rgb);
            let found = palette.colors[usize::from(index)];
            assert!((0..3).all(|i| found[i].abs_diff(rgb[i]) <= 8), "{rgb:?} became {found:?}");
        }
    }
}
