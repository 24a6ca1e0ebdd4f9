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

    #[test]
    fn the_test_and_the_interval_of_pairs_are_those_of_statsmodels() {
        // pip install statsmodels==0.15.0; the interval by Newcombe's formula over its Wilson intervals, for it has none of its own:
        // mcnemar([[a, b], [c, d]], exact=True).pvalue; proportion_confint(k, n, method="wilson").
        let known: [([u64; 4], f64, [f64; 2]); 5] = [
            ([36, 12, 2, 0], 0.012_939_453_125, [0.056_929_584_003_2, 0.340_427_602_974_9]),
            ([20, 12, 2, 16], 0.012_939_453_125, [0.056_156_424_841_7, 0.329_206_995_400_1]),
            ([54, 0, 0, 0], 1.0, [-0.066_413_588_090_9, 0.066_413_588_090_9]),
            ([53, 1, 0, 0], 1.0, [-0.049_621_661_889_4, 0.097_714_374_887_8]),
            // HIL and behavior cloning on stack with 10 demos: docs/runs.md.
            ([424, 48, 16, 12], 7.733_076_881_287e-5, [0.033_092_040_565_7, 0.096_294_027_746_0]),
        ];
        for (counts, p, [low, high]) in known {
            let found = pairs(counts);
            close(found.mcnemar_exact() / p, 1.0, 1e-9);
            close(found.newcombe_95()[0], low, 1e-12);
            close(found.newcombe_95()[1], high, 1e-12);
        }
    }

    #[test]
    fn the_interval_of_independent_rates_is_that_of_statsmodels() {
        // confint_proportions_2indep(56, 70, 48, 80, method="newcomb", compare="diff"): also Newcombe's own table II, 0.0524 to 0.3339.
        for (first, second, [low, high]) in [
            ((56, 70), (48, 80), [0.052_431_472_402_4, 0.333_872_654_036_9]),
            ((9, 10), (3, 10), [0.170_522_723_934_5, 0.809_017_973_535_5]),
        ] {
            let found = newcombe_95(first, second);
            close(found[0], low, 1e-12);
            close(found[1], high, 1e-12);
        }
    }

    #[test]
    fn the_ends_are_no_special_cases() {
        assert_eq!(pairs([0, 0, 0, 0]).mcnemar_exact(), 1.0);
        assert!(newcombe_95((0, 0), (0, 0)).iter().all(|end| end.is_finite()));
        // Thousands of episodes, of which 2^-n is no number: half of the test's p is the probability of at most 900 heads of 2,000.
        close(pairs([50_000, 900, 1_100, 0]).mcnemar_exact() / 8.457_089_535_503_8e-6, 1.0, 1e-9);
        let (here, there) = (pairs([7, 5, 1, 2]), pairs([7, 1, 5, 2]));
        assert_eq!(here.mcnemar_exact(), there.mcnemar_exact());
        close(here.newcombe_95()[0], -there.newcombe_95()[1], 1e-15);
        assert_eq!(Pairs::of([(true, false), (false, true), (true, true), (true, false)].into_iter()), pairs([1, 2, 1, 0]));
    }
}
