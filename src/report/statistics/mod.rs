//! Statistics over seeds by the field's standard: Agarwal et al., *Deep Reinforcement Learning at the Edge of the Statistical Precipice*,
//! NeurIPS 2021, and its library rliable.
//!
//! One policy on many episodes has a Wilson interval ([`crate::eval::wilson_95`]); a method is the distribution that seeds draw policies from,
//! and its intervals are over seeds. Tasks are strata: a bootstrap draws seeds within each task, never tasks.

mod bootstrap;
mod comparison;

pub use comparison::{Comparison, Verdict};

use bootstrap::{Draw, percentiles};

/// What a seed's policy scored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Score {
    /// The seed of demos, training and evaluation.
    pub seed: u64,
    /// Share of episodes solved, 0 to 1.
    pub value: f64,
}

/// The scores of one method: a list a task, a score a seed. Every task has one at least.
pub type Strata = Vec<Vec<Score>>;

/// A value and its 95 % interval over seeds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Of all seeds.
    pub value: f64,
    /// Low and high; of one seed the value itself, which says nothing.
    pub interval: [f64; 2],
}

/// The part of all scores that the interquartile mean leaves out at either end.
const TRIMMED: f64 = 0.25;

/// Mean of the tasks' means, with the stratified bootstrap's interval.
pub fn mean(scores: &Strata) -> Estimate {
    estimate(scores, mean_of)
}

/// Mean of the middle half of all scores, which single lucky and unlucky seeds do not move, with the stratified bootstrap's interval.
pub fn interquartile_mean(scores: &Strata) -> Estimate {
    estimate(scores, |strata| interquartile_mean_of(&strata.concat()))
}

fn estimate(scores: &Strata, statistic: impl Fn(&[Vec<f64>]) -> f64) -> Estimate {
    let values: Vec<Vec<f64>> = scores.iter().map(|task| values(task)).collect();
    let redraw = |draw: &mut Draw| statistic(&values.iter().map(|task| draw.of(task)).collect::<Vec<_>>());
    let interval =
        if values.iter().all(|task| task.len() == 1) { [statistic(&values); 2] } else { percentiles("estimate", redraw) };
    Estimate { value: statistic(&values), interval }
}

fn values(scores: &[Score]) -> Vec<f64> {
    scores.iter().map(|score| score.value).collect()
}

/// The mean of some numbers; of none it is none.
pub fn average(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn mean_of(strata: &[Vec<f64>]) -> f64 {
    average(&strata.iter().map(|task| average(task)).collect::<Vec<_>>())
}

fn interquartile_mean_of(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let cut = (TRIMMED * sorted.len() as f64) as usize;
    average(&sorted[cut..sorted.len() - cut])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Five seeds of three tasks, one row a seed, and what rliable 1.2.0 says of them:
    ///
    /// ```text
    /// pip install rliable==1.2.0 "pandas<3"
    /// np.random.seed(0)
    /// rly.get_interval_estimates({"x": x}, lambda v: np.array([metrics.aggregate_iqm(v), metrics.aggregate_mean(v)]), reps=50000)
    /// rly.get_interval_estimates({"x,y": (x, y)}, metrics.probability_of_improvement, reps=20000)
    /// x: iqm 0.65777778 [0.62222222, 0.68666667], mean 0.66 [0.632, 0.68866667]; x,y: 0.7 [0.49333333, 0.88]
    /// ```
    pub const X: [[f64; 3]; 5] =
        [[0.58, 0.97, 0.31], [0.61, 0.94, 0.52], [0.55, 0.99, 0.40], [0.70, 0.91, 0.47], [0.64, 0.96, 0.35]];
    pub const Y: [[f64; 3]; 5] =
        [[0.52, 0.97, 0.44], [0.66, 0.90, 0.30], [0.49, 0.93, 0.28], [0.60, 0.92, 0.41], [0.57, 0.98, 0.25]];

    pub fn strata(rows: &[[f64; 3]]) -> Strata {
        (0..3).map(|task| (0..).zip(rows).map(|(seed, row)| Score { seed, value: row[task] }).collect()).collect()
    }

    pub fn close(a: f64, b: f64, tolerance: f64) {
        assert!((a - b).abs() <= tolerance, "{a}, not {b}");
    }

    #[test]
    fn means_and_their_intervals_are_those_of_rliable() {
        let (iqm, mean) = (interquartile_mean(&strata(&X)), mean(&strata(&X)));
        close(iqm.value, 0.657_777_777_777, 1e-9);
        close(mean.value, 0.66, 1e-12);
        // 10,000 draws against 50,000 of other random numbers.
        for (ours, theirs) in iqm.interval.into_iter().chain(mean.interval).zip([0.622_222_22, 0.686_666_67, 0.632, 0.688_666_67])
        {
            close(ours, theirs, 0.004);
        }
        let rliable = comparison::Comparison::of(&strata(&X), &strata(&Y)).expect("shared tasks").improvement;
        close(rliable.value, 0.7, 1e-12);
        close(rliable.interval[0], 0.493_333_33, 0.02);
        close(rliable.interval[1], 0.88, 0.02);
    }

    #[test]
    fn the_middle_half_is_what_is_averaged() {
        // scipy.stats.trim_mean cuts int(.25 n) at either end: 1 of 6, 2 of 8, none of 3.
        close(interquartile_mean_of(&[9.0, 1.0, 2.0, 3.0, 4.0, -7.0]), 2.5, 0.0);
        close(interquartile_mean_of(&[0.0, 0.0, 1.0, 2.0, 3.0, 4.0, 8.0, 9.0]), 2.5, 0.0);
        close(interquartile_mean_of(&[0.0, 1.0, 5.0]), 2.0, 0.0);
    }

    #[test]
    fn one_seed_has_no_interval_and_equal_seeds_have_none_to_either_side() {
        let one = vec![vec![Score { seed: 4, value: 0.3 }]];
        assert_eq!(mean(&one), Estimate { value: 0.3, interval: [0.3, 0.3] });
        let equal = vec![(0..5).map(|seed| Score { seed, value: 1.0 }).collect()];
        assert_eq!(mean(&equal), Estimate { value: 1.0, interval: [1.0, 1.0] });
        assert_eq!(mean(&strata(&X)), mean(&strata(&X)), "the same draws each time");
    }
}
