//! Statistics over all frames of a dataset, exact, in memory that does not grow with it. Sums run along as the frames are written; then the
//! frames are read again from a scratch file, for the variances and for one digit after the other of the values that quantiles lie between.

use super::cells::{Cells, Kind};
use super::features::Feature;
use super::scratch::Scratch;
use super::stats::{LEVELS, NAMES, Stats, neighbours, of_entry};
use crate::error::Result;
use crate::interrupt::Interrupt;
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::path::Path;

/// Bits of a digit: three of them tell two f32 apart, and a table of counts has 16 kB.
const DIGIT_BITS: u32 = 11;
const DIGITS: usize = 1 << DIGIT_BITS;

/// The statistics of all features, as far as they are known.
pub(super) struct Whole<'a> {
    features: &'a [Feature],
    /// The entries of each.
    columns: Vec<Vec<Entry>>,
    frames: usize,
    scratch: Scratch<'a>,
}

/// One column of numbers.
struct Entry {
    sum: f64,
    /// Sum of squared deviations from the mean.
    squares: f64,
    /// Least and greatest key.
    least: u64,
    most: u64,
    /// Bits of a key, counted from the least, that are not yet known of the values that are looked for.
    bits: u32,
    searches: Vec<Search>,
}

/// Values that are looked for and share all bits that are known.
struct Search {
    /// These bits.
    known: u64,
    /// How many values with these bits have each next digit.
    counts: Vec<usize>,
    /// The places of these values in the sorted column, and among the values with these bits.
    places: Vec<(usize, usize)>,
}

impl<'a> Whole<'a> {
    /// Of no frames, with a scratch file in `dir`.
    pub(super) fn new(features: &'a [Feature], dir: &'a Path) -> Result<Self> {
        let columns = features.iter().map(|f| (0..f.width).map(|_| Entry::new()).collect()).collect();
        Ok(Whole { features, columns, frames: 0, scratch: Scratch::new(dir)? })
    }

    /// Adds the frames of a window of episodes, in their order.
    pub(super) fn add(&mut self, episodes: &[&[Cells]]) -> Result<()> {
        let numbers = self.columns.par_iter_mut().enumerate().map(|(i, entries)| {
            let mut bytes = Vec::new();
            for cells in episodes {
                cells[i].for_each(entries.len(), |at, value, key| {
                    let entry = &mut entries[at];
                    entry.sum += value;
                    (entry.least, entry.most) = (entry.least.min(key), entry.most.max(key));
                });
                cells[i].push_bytes(&mut bytes);
            }
            bytes
        });
        self.scratch.add(&numbers.collect::<Vec<_>>())?;
        self.frames += episodes.iter().map(|cells| cells[0].len() / self.features[0].width).sum::<usize>();
        Ok(())
    }

    /// The statistics.
    pub(super) fn finish(mut self, interrupt: &Interrupt) -> Result<Vec<Stats>> {
        let frames = self.frames;
        self.columns.iter_mut().flatten().for_each(|entry| entry.begin(frames));
        self.pass(interrupt, true)?;
        while self.columns.iter().flatten().any(|entry| entry.bits > 0) {
            self.pass(interrupt, false)?;
        }
        let columns = self.columns.iter().zip(self.features);
        Ok(columns.map(|(entries, feature)| of_feature(entries, feature.kind, frames)).collect())
    }

    /// Reads all frames once: the squares when it is the `first` time, and a digit.
    fn pass(&mut self, interrupt: &Interrupt, first: bool) -> Result<()> {
        let (scratch, frames) = (&self.scratch, self.frames);
        self.columns.par_iter_mut().zip(self.features).enumerate().try_for_each(|(i, (entries, feature))| {
            if !first && entries.iter().all(|entry| entry.bits == 0) {
                return Ok(());
            }
            scratch.column(i, feature.kind, |cells| {
                see(entries, &cells, frames, first);
                interrupt.check()
            })?;
            entries.iter_mut().for_each(Entry::take_digit);
            Ok(())
        })
    }
}

/// Adds values that were read again.
fn see(entries: &mut [Entry], cells: &Cells, frames: usize, first: bool) {
    let means: Vec<f64> = entries.iter().map(|entry| entry.sum / frames as f64).collect();
    cells.for_each(entries.len(), |at, value, key| {
        let entry = &mut entries[at];
        if first {
            entry.squares += (value - means[at]).powi(2);
        }
        if entry.bits > 0 {
            entry.count(key);
        }
    });
}

fn of_feature(entries: &[Entry], kind: Kind, frames: usize) -> Stats {
    let mut rows = vec![Vec::with_capacity(entries.len()); NAMES.len()];
    for entry in entries {
        let sorted = |place: usize| kind.value(entry.key_at(place, frames));
        let found = of_entry(frames, entry.sum / frames as f64, entry.squares / frames as f64, sorted);
        rows.iter_mut().zip(found).for_each(|(row, value)| row.push(value));
    }
    Stats { rows, count: frames }
}

impl Entry {
    fn new() -> Self {
        // A sum of floats begins at -0.
        Entry { sum: -0.0, squares: -0.0, least: u64::MAX, most: 0, bits: 0, searches: Vec::new() }
    }

    /// Looks for the values beside all quantiles, of which nothing is known but the range.
    fn begin(&mut self, frames: usize) {
        let range = self.most - self.least;
        self.bits = (u64::BITS - range.leading_zeros()).next_multiple_of(DIGIT_BITS);
        let beside = LEVELS.map(|level| neighbours(level, frames));
        let places: BTreeSet<usize> = beside.into_iter().flat_map(|(below, above, _)| [below, above]).collect();
        self.searches = vec![Search::new(0, places.into_iter().map(|place| (place, place)).collect())];
    }

    /// Counts the next digit of a value that may be looked for.
    fn count(&mut self, key: u64) {
        let key = key - self.least;
        // All 64 bits are unknown when there are six digits.
        let known = key.checked_shr(self.bits).unwrap_or(0);
        if let Ok(at) = self.searches.binary_search_by_key(&known, |search| search.known) {
            self.searches[at].counts[(key >> (self.bits - DIGIT_BITS)) as usize % DIGITS] += 1;
        }
    }

    /// The counts tell the next digit of every value that is looked for.
    fn take_digit(&mut self) {
        if self.bits == 0 {
            return;
        }
        self.bits -= DIGIT_BITS;
        let mut found: Vec<Search> = Vec::new();
        for search in &self.searches {
            for (place, among) in &search.places {
                let (digit, among) = search.digit_at(*among);
                let known = search.known << DIGIT_BITS | digit;
                match found.last_mut().filter(|last| last.known == known) {
                    Some(last) => last.places.push((*place, among)),
                    None => found.push(Search::new(known, vec![(*place, among)])),
                }
            }
        }
        self.searches = found;
    }

    /// The key at a place of the sorted column: at either end, or one that was looked for.
    fn key_at(&self, place: usize, frames: usize) -> u64 {
        let is_here = |search: &&Search| search.places.iter().any(|(p, _)| *p == place);
        match self.searches.iter().find(is_here) {
            Some(search) => self.least + search.known,
            None if place + 1 == frames => self.most,
            None => self.least,
        }
    }
}

impl Search {
    /// `places` are in order.
    fn new(known: u64, places: Vec<(usize, usize)>) -> Self {
        Search { known, counts: vec![0; DIGITS], places }
    }

    /// The next digit of the value that is the `among`-th of these, and its place among those with this digit too.
    fn digit_at(&self, mut among: usize) -> (u64, usize) {
        for (digit, count) in self.counts.iter().enumerate() {
            if among < *count {
                return (digit as u64, among);
            }
            among -= count;
        }
        unreachable!("as many values are read again as were written")
    }
}

#[cfg(test)]
mod tests {
    use super::super::stats::stats;
    use super::*;

    /// The statistics by passes, of windows of a few rows.
    fn by_passes(cells: &Cells, kind: Kind, width: usize) -> Stats {
        let (features, dir) = ([Feature { name: "any".into(), kind, width, names: None, doc: "" }], std::env::temp_dir());
        let mut whole = Whole::new(&features, &dir).expect("a scratch file");
        let windows: Vec<Cells> = match cells {
            Cells::F32(v) => v.chunks(width * 100).map(|part| Cells::F32(part.to_vec())).collect(),
            Cells::F64(v) => v.chunks(width * 100).map(|part| Cells::F64(part.to_vec())).collect(),
            Cells::I64(v) => v.chunks(width * 100).map(|part| Cells::I64(part.to_vec())).collect(),
            Cells::Bool(v) => v.chunks(width * 100).map(|part| Cells::Bool(part.to_vec())).collect(),
        };
        windows.iter().for_each(|window| whole.add(&[std::slice::from_ref(window)]).expect("written"));
        whole.finish(&Interrupt::default()).expect("read").remove(0)
    }

    #[test]
    fn passes_give_the_bits_that_sorting_gives() {
        let mut state = 7_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            state >> 33
        };
        for rows in [1, 2, 3, 100, 997] {
            let mixed =
                (0..rows * 3).map(|i| [f32::from_bits(random() as u32 % 0x7f80_0000), -0.0, 0.1, -(random() as f32)][i % 4]);
            let cases = [
                (Cells::F32(mixed.collect()), Kind::F32, 3),
                (Cells::F32(vec![0.1; rows]), Kind::F32, 1),
                (Cells::F64((0..rows).map(|i| [1e300, -0.0, -1e-300, 0.1, f64::MIN][i % 5]).collect()), Kind::F64, 1),
                (Cells::F32(vec![-0.0; rows]), Kind::F32, 1),
                (Cells::I64((0..rows as i64).rev().collect()), Kind::I64, 1),
                (Cells::I64((0..rows).map(|i| [i64::MIN, i64::MAX, 5][i % 3]).collect()), Kind::I64, 1),
                (Cells::Bool((0..rows).map(|i| i % 7 == 0).collect()), Kind::Bool, 1),
            ];
            for (cells, kind, width) in cases {
                let bits = |found: Stats| found.rows.concat().into_iter().map(f64::to_bits).collect::<Vec<_>>();
                let (passed, sorted) = (by_passes(&cells, kind, width), stats(&cells.to_f64(), width));
                assert_eq!(passed.count, sorted.count);
                assert_eq!(bits(passed), bits(sorted), "{rows} rows of {cells:?}");
            }
        }
    }
}
