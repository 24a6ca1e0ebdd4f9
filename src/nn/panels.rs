//! Matrices of samples in panels of eight rows.

use super::kernel;
use super::lanes::{LANES, Lanes, panels_of};
use std::ops::Range;

/// A matrix in panels: entry `i` of row `r` is lane `r % 8` of element `i` of panel `r / 8`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Panels {
    width: usize,
    data: Vec<Lanes>,
}

impl Panels {
    /// Sees to it that [`Panels::grow`] for at most `panels` panels of this width does not allocate.
    pub fn reserve(&mut self, width: usize, panels: usize) {
        self.data.reserve((width * panels).saturating_sub(self.data.len()));
    }

    /// Room for `panels` panels of this width, all 0 where it is new; keeps what is there and never shrinks under one width.
    pub fn grow(&mut self, width: usize, panels: usize) {
        if self.width != width {
            self.data.clear();
            self.width = width;
        }
        if self.data.len() < width * panels {
            self.data.resize(width * panels, Lanes::default());
        }
    }

    /// Number of entries of a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// The entries of one panel.
    pub fn panel(&self, p: usize) -> &[Lanes] {
        &self.data[p * self.width..(p + 1) * self.width]
    }

    /// The same, to be changed.
    pub fn panel_mut(&mut self, p: usize) -> &mut [Lanes] {
        &mut self.data[p * self.width..(p + 1) * self.width]
    }

    /// Several panels, one after another.
    pub fn span(&self, panels: &Range<usize>) -> &[Lanes] {
        &self.data[panels.start * self.width..panels.end * self.width]
    }

    /// The same, to be changed.
    pub fn span_mut(&mut self, panels: &Range<usize>) -> &mut [Lanes] {
        &mut self.data[panels.start * self.width..panels.end * self.width]
    }

    /// All panels before `p`, and the rest.
    pub fn split_at_mut(&mut self, p: usize) -> (&[Lanes], &mut [Lanes]) {
        let (before, after) = self.data.split_at_mut(p * self.width);
        (before, after)
    }

    /// Entry `i` of row `r`.
    #[inline]
    pub fn get(&self, r: usize, i: usize) -> f32 {
        self.data[r / LANES * self.width + i].0[r % LANES]
    }

    /// Sets entry `i` of row `r`.
    #[inline]
    pub fn set(&mut self, r: usize, i: usize, value: f32) {
        self.data[r / LANES * self.width + i].0[r % LANES] = value;
    }

    /// Writes the first entries of row `r`.
    #[inline]
    pub fn write_row(&mut self, r: usize, values: &[f32]) {
        let panel = &mut self.data[r / LANES * self.width..][..self.width];
        let lane = r % LANES;
        panel.iter_mut().zip(values).for_each(|(slot, v)| slot.0[lane] = *v);
    }

    /// Reads the first entries of row `r`.
    #[inline]
    pub fn read_row(&self, r: usize, values: &mut [f32]) {
        let panel = &self.data[r / LANES * self.width..][..self.width];
        let lane = r % LANES;
        values.iter_mut().zip(panel).for_each(|(v, slot)| *v = slot.0[lane]);
    }

    /// Reads whole rows, the first ones, one after another.
    pub fn read_rows(&self, values: &mut [f32]) {
        let panels = values.chunks_mut(LANES * self.width).enumerate();
        panels.for_each(|(p, rows)| read_panel(self.panel(p), rows));
    }

    /// Writes the first entries of the rows from panel `panel` on: `count` rows of one length; the lanes of the last panel that none of
    /// them fills are set to 0.
    pub fn write_rows<'a>(&mut self, panel: usize, count: usize, row: impl Fn(usize) -> &'a [f32]) {
        for p in 0..panels_of(count) {
            let rows = std::array::from_fn(|lane| row((p * LANES + lane).min(count - 1)));
            kernel::interleave(&mut self.panel_mut(panel + p)[..rows[0].len()], rows);
        }
        self.clear_tail(panel * LANES + count);
    }

    /// Zeroes the lanes of row `r` and of all later rows of its panel; nothing when `r` begins a panel.
    pub fn clear_tail(&mut self, r: usize) {
        if !r.is_multiple_of(LANES) {
            self.panel_mut(r / LANES).iter_mut().for_each(|slot| slot.0[r % LANES..].fill(0.0));
        }
    }
}

/// Reads whole rows of a panel, the first ones, one after another.
pub fn read_panel(panel: &[Lanes], values: &mut [f32]) {
    let mut rows = values.chunks_exact_mut(panel.len());
    if rows.len() == LANES {
        kernel::separate(std::array::from_fn(|_| rows.next().expect("eight rows")), panel);
    } else {
        rows.enumerate().for_each(|(lane, row)| row.iter_mut().zip(panel).for_each(|(v, entry)| *v = entry.0[lane]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back_and_tails_are_cleared() {
        let mut panels = Panels::default();
        panels.grow(3, panels_of(11));
        let rows: Vec<[f32; 3]> = (0..11).map(|r| [r as f32, 10.0 + r as f32, -1.0]).collect();
        rows.iter().enumerate().for_each(|(r, row)| panels.write_row(r, row));
        let mut together = panels.clone();
        together.write_rows(0, 11, |r| &rows[r]);
        assert_eq!(together, panels);
        let mut all = [[0.0; 3]; 11];
        panels.read_rows(all.as_flattened_mut());
        assert_eq!(all.as_slice(), rows);
        let mut row = [0.0; 3];
        panels.read_row(9, &mut row);
        assert_eq!((row, panels.get(9, 1)), ([9.0, 19.0, -1.0], 19.0));
        assert_eq!(panels.panel(1)[0].0[..3], [8.0, 9.0, 10.0]);
        panels.set(10, 2, 7.0);
        panels.clear_tail(9);
        assert_eq!(panels.panel(1)[2].0, [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let kept = panels.clone();
        panels.clear_tail(8);
        assert_eq!(panels, kept);
    }
}
