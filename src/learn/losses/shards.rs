//! A batch is cut into shards whose number depends on its size alone, never on the threads: the sums come out the same bytes.

use crate::nn::kernel::wide;
use std::ops::Range;

/// Most shards of a batch: two for each of two cores evens out the load, more would only make the matrices thinner.
pub const MAX_SHARDS: usize = 4;
/// Most shards of the segments of state cloning: their matrices grow thin with depth anyway.
pub const MAX_SEGMENT_SHARDS: usize = 2;
/// Rows below which a matrix product no longer pays for a shard of its own.
const MIN_ROWS: usize = 64;

/// Number of shards of a batch.
pub fn count(rows: usize) -> usize {
    (rows / MIN_ROWS).clamp(1, MAX_SHARDS)
}

/// Most rows that a shard of at most `rows` rows has.
pub fn most_rows(rows: usize) -> usize {
    rows.div_ceil(MAX_SHARDS).max(rows.min(2 * MIN_ROWS))
}

/// The rows of shard `i` of `count`.
pub fn range(rows: usize, count: usize, i: usize) -> Range<usize> {
    rows * i / count..rows * (i + 1) / count
}

/// The shard of row `r` of `rows`, and that shard's first row.
pub fn place(rows: usize, r: usize) -> (usize, usize) {
    let count = count(rows);
    let shard = (0..count).position(|i| r < range(rows, count, i).end).unwrap_or(count - 1);
    (shard, range(rows, count, shard).start)
}

/// total += factor x part.
pub fn add_scaled(total: &mut [f32], part: &[f32], factor: f32) {
    wide(|| total.iter_mut().zip(part).for_each(|(t, p)| *t += factor * p));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_cover_every_row_once() {
        for rows in [1, 63, 128, 511, 2320] {
            let n = count(rows);
            let covered: Vec<usize> = (0..n).flat_map(|i| range(rows, n, i)).collect();
            assert_eq!(covered, (0..rows).collect::<Vec<_>>());
            let placed = |i: usize| range(rows, n, i).all(|r| place(rows, r) == (i, range(rows, n, i).start));
            assert!((0..n).all(placed));
            assert!((0..n).all(|i| range(rows, n, i).len() <= most_rows(rows) && most_rows(rows) <= most_rows(rows + 1)));
        }
    }
}
