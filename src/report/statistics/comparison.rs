//! Whether one method is better than another.

use super::bootstrap::{Draw, percentiles};
use super::{Estimate, Score, Strata, average, mean_of, values};

/// Seeds below which no interval over them is believed: of two there are only three different samples.
pub const FEWEST_SEEDS: usize = 3;
/// The probability of improvement of two methods that are the same.
const EVEN: f64 = 0.5;

/// Method X beside method Y, over the tasks that both have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// Mean of X - Y over the seeds that both have, then over tasks; the bootstrap draws pairs.
    pub difference: Estimate,
    /// Probability that a policy of X beats one of Y on the same task (a tie counts half), mean over tasks; the bootstrap draws X and Y apart,
    /// as rliable does.
    pub improvement: Estimate,
    /// Pairs of the task that has fewest.
    pub pairs: usize,
}

/// What a comparison comes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Both intervals lie above their neutral value.
    Better,
    /// Both lie below.
    Worse,
    /// One of them contains it.
    CannotTell,
    /// Fewer than three seeds.
    TooFew,
}

impl Comparison {
    /// `None` when they share no seed of any task. Both have the same tasks in the same places; one that either lacks is empty.
    pub fn of(x: &Strata, y: &Strata) -> Option<Self> {
        let pairs: Vec<Vec<f64>> = x.iter().zip(y).map(|(x, y)| differences(x, y)).filter(|task| !task.is_empty()).collect();
        let both: Vec<(Vec<f64>, Vec<f64>)> =
            x.iter().zip(y).map(|(x, y)| (values(x), values(y))).filter(|(x, y)| !x.is_empty() && !y.is_empty()).collect();
        let fewest = pairs.iter().map(Vec::len).min()?;
        let drawn_pairs = |draw: &mut Draw| mean_of(&pairs.iter().map(|task| draw.of(task)).collect::<Vec<_>>());
        let drawn_apart = |draw: &mut Draw| {
            let apart: Vec<_> = both.iter().map(|(x, y)| (draw.of(x), draw.of(y))).collect();
            improvement(&apart)
        };
        Some(Comparison {
            difference: Estimate { value: mean_of(&pairs), interval: percentiles("difference", drawn_pairs) },
            improvement: Estimate { value: improvement(&both), interval: percentiles("improvement", drawn_apart) },
            pairs: fewest,
        })
    }

    /// Told apart only when both intervals say so.
    pub fn verdict(&self) -> Verdict {
        let (difference, improvement) = (self.difference.interval, self.improvement.interval);
        match self.pairs {
            n if n < FEWEST_SEEDS => Verdict::TooFew,
            _ if difference[0] > 0.0 && improvement[0] > EVEN => Verdict::Better,
            _ if difference[1] < 0.0 && improvement[1] < EVEN => Verdict::Worse,
            _ => Verdict::CannotTell,
        }
    }
}

/// X - Y of each seed that both have.
fn differences(x: &[Score], y: &[Score]) -> Vec<f64> {
    x.iter().filter_map(|x| y.iter().find(|y| y.seed == x.seed).map(|y| x.value - y.value)).collect()
}

/// The Mann-Whitney statistic as a share of all pairs, mean over tasks.
fn improvement(tasks: &[(Vec<f64>, Vec<f64>)]) -> f64 {
    let of_task = |(x, y): &(Vec<f64>, Vec<f64>)| {
        let against = |x: &f64| {
            y.iter()
                .map(|y| {
                    if x > y {
                        1.0
                    } else if x == y {
                        EVEN
                    } else {
                        0.0
                    }
                })
                .sum::<f64>()
        };
        x.iter().map(against).sum::<f64>() / (x.len() * y.len()) as f64
    };
    average(&tasks.iter().map(of_task).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::super::tests::{X, Y, close, strata};
    use super::*;

    #[test]
    fn the_difference_is_that_of_pairs() {
        let found = Comparison::of(&strata(&X), &strata(&Y)).expect("shared seeds");
        // Sums of X - Y by hand: .24, .07, .37 over five seeds.
        close(found.difference.value, (0.24 + 0.07 + 0.37) / 15.0, 1e-12);
        assert_eq!((found.pairs, found.verdict()), (5, Verdict::CannotTell));
        let mirrored = Comparison::of(&strata(&Y), &strata(&X)).expect("shared seeds");
        close(mirrored.difference.value, -found.difference.value, 1e-12);
        close(mirrored.improvement.value, 1.0 - found.improvement.value, 1e-12);
    }

    #[test]
    fn seeds_are_paired_by_their_number_and_others_left_out() {
        let scores = |of: &[(u64, f64)]| vec![of.iter().map(|(seed, value)| Score { seed: *seed, value: *value }).collect()];
        let (x, y) = (scores(&[(1, 0.9), (2, 0.5), (3, 0.7), (9, 0.0)]), scores(&[(3, 0.6), (2, 0.4), (1, 0.8)]));
        let found = Comparison::of(&x, &y).expect("shared seeds");
        close(found.difference.value, 0.1, 1e-12);
        assert!(found.difference.interval[0] > 0.099 && found.pairs == 3);
        assert_eq!(Comparison::of(&x, &scores(&[(4, 0.6)])), None);
    }

    #[test]
    fn methods_are_told_apart_when_every_seed_says_so_and_not_by_two_seeds() {
        let of = |n: u64, value: f64| vec![(0..n).map(|seed| Score { seed, value: value + 0.01 * seed as f64 }).collect()];
        let verdict = |n, x, y| Comparison::of(&of(n, x), &of(n, y)).expect("shared seeds").verdict();
        assert_eq!((verdict(5, 0.9, 0.5), verdict(5, 0.5, 0.9)), (Verdict::Better, Verdict::Worse));
        assert_eq!((verdict(5, 0.5, 0.5), verdict(2, 0.9, 0.5)), (Verdict::CannotTell, Verdict::TooFew));
    }
}
