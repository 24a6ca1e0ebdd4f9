//! Which episodes train and which validate.

use crate::seed::stream;
use rand::seq::SliceRandom;

/// Stage name of the random stream.
const STAGE: &str = "convert/split";

/// Splits the positions `0..n` into training and validation, `train_per_validation` to one, to the nearest episode: 200, 250 and
/// 300 episodes give 182/18, 227/23 and 273/27 at ten to one, the paper's numbers (4.2). Both come sorted; from two episodes on,
/// neither is empty.
pub fn split(n: usize, train_per_validation: u32, seed: u64) -> (Vec<usize>, Vec<usize>) {
    let mut order: Vec<usize> = (0..n).collect();
    order.shuffle(&mut stream(seed, STAGE, 0));
    let mut train = order.split_off(validation_count(n, train_per_validation));
    train.sort_unstable();
    order.sort_unstable();
    (train, order)
}

/// n / (ratio + 1), to the nearest.
fn validation_count(n: usize, train_per_validation: u32) -> usize {
    let parts = train_per_validation as usize + 1;
    let nearest = (n + parts / 2) / parts;
    if n < 2 { 0 } else { nearest.clamp(1, n - 1) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_three_splits_come_out() {
        for (n, train, validation) in [(200, 182, 18), (250, 227, 23), (300, 273, 27), (2, 1, 1), (3, 2, 1), (1, 1, 0), (0, 0, 0)]
        {
            let (a, b) = split(n, 10, 7);
            assert_eq!((a.len(), b.len()), (train, validation), "of {n}");
            let mut all = [a, b].concat();
            all.sort_unstable();
            assert_eq!(all, (0..n).collect::<Vec<_>>());
        }
    }

    #[test]
    fn the_split_depends_on_the_seed_alone() {
        assert_eq!(split(200, 10, 1), split(200, 10, 1));
        assert_ne!(split(200, 10, 1), split(200, 10, 2));
    }
}
