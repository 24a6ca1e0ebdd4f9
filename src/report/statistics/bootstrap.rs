//! The percentile bootstrap: a statistic of many samples drawn with replacement, the same draws each time.

use crate::seed;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Samples of a bootstrap: the ends of a 95 % interval of 30 scores move by less than .002 from one choice of draws to the next.
const DRAWS: usize = 10_000;
/// Seed of all bootstraps.
const SEED: u64 = 0;
/// Ends of a 95 % interval, as shares of the draws.
const ENDS: [f64; 2] = [0.025, 0.975];

/// One sample's random numbers.
pub(super) struct Draw(ChaCha8Rng);

impl Draw {
    /// As many of these values, with repetitions.
    pub(super) fn of(&mut self, values: &[f64]) -> Vec<f64> {
        self.indices(values.len()).into_iter().map(|i| values[i]).collect()
    }

    /// `n` numbers below `n`, with repetitions.
    fn indices(&mut self, n: usize) -> Vec<usize> {
        // The product's upper half; n is small, so that no number is preferred by more than n / 2^64.
        let below = |random: u64| ((u128::from(random) * n as u128) >> u64::BITS) as usize;
        (0..n).map(|_| below(self.0.next_u64())).collect()
    }
}

/// The 95 % interval of what `redraw` gives for each sample; `purpose` names the random streams.
pub(super) fn percentiles(purpose: &str, mut redraw: impl FnMut(&mut Draw) -> f64) -> [f64; 2] {
    let mut draw = Draw(seed::stream(SEED, &format!("report.{purpose}"), 0));
    let mut values: Vec<f64> = (0..DRAWS).map(|_| redraw(&mut draw)).collect();
    values.sort_by(f64::total_cmp);
    ENDS.map(|share| quantile(&values, share))
}

/// Between two neighbours by a straight line, as numpy has it.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let at = share * (sorted.len() - 1) as f64;
    let (below, part) = (at.floor() as usize, at.fract());
    let above = (below + 1).min(sorted.len() - 1);
    // Exact where both are equal, so that an interval without width has none.
    sorted[below] + part * (sorted[above] - sorted[below])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_numpy() {
        assert_eq!(quantile(&[1.0, 2.0, 4.0, 8.0, 16.0], 0.5), 4.0);
        assert_eq!(quantile(&[1.0, 2.0, 4.0, 8.0, 16.0], 0.9), 8.0 + 0.6 * 8.0);
        assert_eq!(quantile(&[3.0], 0.975), 3.0);
    }

    #[test]
    fn every_index_is_drawn_and_none_beyond_the_last() {
        let mut draw = Draw(seed::stream(SEED, "test", 0));
        let mut counts = [0; 5];
        (0..1000).for_each(|_| draw.indices(5).into_iter().for_each(|i| counts[i] += 1));
        assert!(counts.iter().all(|count| (900..1100).contains(count)), "{counts:?}");
    }
}
