//! The difference of two rates: of the same episodes by two policies, which are pairs, or of different ones.
//!
//! The intervals are those of R. G. Newcombe, made of the Wilson intervals of the two rates: for pairs method 10 of "Improved confidence
//! intervals for the difference between binomial proportions based on paired data", Statistics in Medicine 17 (1998) 2635-2650, for others method
//! 10 of "Interval estimation for the difference between independent proportions: comparison of eleven methods", the same volume, 873-890.

use super::wilson_95;
use crate::math;
use serde::Serialize;

/// How the episodes that two policies were both tried on ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Pairs {
    /// Solved by both.
    pub both: u64,
    /// Solved by the first alone.
    pub only_first: u64,
    /// Solved by the second alone.
    pub only_second: u64,
    /// Solved by neither.
    pub neither: u64,
}

impl Pairs {
    /// Counts episodes: whether the first solved each, and whether the second did.
    pub fn of(episodes: impl Iterator<Item = (bool, bool)>) -> Self {
        let mut pairs = Pairs::default();
        for outcome in episodes {
            *match outcome {
                (true, true) => &mut pairs.both,
                (true, false) => &mut pairs.only_first,
                (false, true) => &mut pairs.only_second,
                (false, false) => &mut pairs.neither,
            } += 1;
        }
        pairs
    }

    /// Episodes.
    pub fn all(&self) -> u64 {
        self.both + self.only_first + self.only_second + self.neither
    }

    /// Episodes that the first and the second solved.
    pub fn successes(&self) -> [u64; 2] {
        [self.both + self.only_first, self.both + self.only_second]
    }

    /// The first rate without the second.
    pub fn difference(&self) -> f64 {
        (self.only_first as f64 - self.only_second as f64) / self.all().max(1) as f64
    }

    /// Its 95 % interval.
    pub fn newcombe_95(&self) -> [f64; 2] {
        let [first, second] = self.successes();
        square_and_add((first, self.all()), (second, self.all()), self.difference(), self.correlation())
    }

    /// Correlation of the two outcomes over the episodes, drawn towards 0 as Newcombe has it.
    fn correlation(&self) -> f64 {
        let [a, b, c, d] = [self.both, self.only_first, self.only_second, self.neither].map(|n| n as f64);
        let margins = (a + b) * (c + d) * (a + c) * (b + d);
        if margins == 0.0 {
            return 0.0;
        }
        let (product, half) = (a * d - b * c, self.all() as f64 / 2.0);
        let drawn = if product > 0.0 { (product - half).max(0.0) } else { product };
        drawn / margins.sqrt()
    }

    /// McNemar's exact test, two-sided: how likely episodes of which only one solved are split at least so unevenly when none is better, that
    /// is, by a fair coin. 1 when there are none.
    pub fn mcnemar_exact(&self) -> f64 {
        let changed = self.only_first + self.only_second;
        let fewer = self.only_first.min(self.only_second);
        // Logarithms: 2^-n of some thousand episodes is no number.
        let mut ln_term = -(changed as f64) * std::f64::consts::LN_2;
        let mut tail = 0.0;
        for k in 0..=fewer {
            tail += math::exp(ln_term);
            ln_term += math::ln((changed - k) as f64) - math::ln((k + 1) as f64);
        }
        (2.0 * tail).min(1.0)
    }
}

/// The 95 % interval of the difference of two rates, (successes, trials), of different episodes.
pub fn newcombe_95(first: (u64, u64), second: (u64, u64)) -> [f64; 2] {
    let rate = |(successes, trials): (u64, u64)| successes as f64 / trials.max(1) as f64;
    square_and_add(first, second, rate(first) - rate(second), 0.0)
}

/// Ends as far from the difference as the ends of the two Wilson intervals are from their rates, squared and added.
fn square_and_add(first: (u64, u64), second: (u64, u64), difference: f64, correlation: f64) -> [f64; 2] {
    let ends = |(successes, trials): (u64, u64)| {
        let (rate, [low, high]) = (successes as f64 / trials.max(1) as f64, wilson_95(successes, trials));
        [rate - low, high - rate]
    };
    let ([below_first, above_first], [below_second, above_second]) = (ends(first), ends(second));
    // Of a correlation of 1 rounding may leave less than nothing.
    let apart = |x: f64, y: f64| (x * x - 2.0 * correlation * x * y + y * y).max(0.0).sqrt();
    [difference - apart(below_first, above_second), difference + apart(above_first, below_second)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pairs([both, only_first, only_second, neither]: [u64; 4]) -> Pairs {
        Pairs { both, only_first, only_second, neither }
    }

    fn close(got: f64, want: f64, within: f64) {
        assert!((got - want).abs() <= within, "{got} against {want}");
    }

    #[test]
    fn a_published_example_of_pairs() {
        // Fagerland, Lydersen & Laake, "Recommended tests and confidence intervals for paired binomial proportions", Stat. Med. 33 (2014): airway
        // hyper-responsiveness of 21 children before and after a transplantation, counts 1, 1, 7, 12: difference -0.286, McNemar's exact test
        // .070, Newcombe's interval -0.507 to -0.026.
        let example = pairs([1, 1, 7, 12]);
        close(example.difference(), -0.286, 5e-4);
        close(example.mcnemar_exact(), 2.0 * 9.0 / 256.0, 1e-12);
        let [low, high] = example.newcombe_95();
        close(low, -0.507, 5e-4);
        close(high, -0.026, 5e-4);
    }
}
