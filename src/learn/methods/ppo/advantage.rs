//! Generalised advantage estimation (Schulman et al. 2016).

use crate::env::End;
use crate::nn::{LANES, Lanes};

/// How rewards become advantages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Credit {
    /// gamma: what a reward is worth a step later.
    pub gamma: f32,
    /// lambda: how much of the advantage of later steps an action gets.
    pub lambda: f32,
}

impl Credit {
    /// The unit of values: what a reward of 1 in every step is worth, for ever.
    pub fn value_unit(self) -> f32 {
        1.0 / (1.0 - self.gamma)
    }
}

/// Advantages of the steps and what the values should have been, backwards in time. `values` (one more than steps) are in units of
/// `credit.value_unit()`, and so are `returns`; the reward of a step that cut an episode off already holds what was promised.
pub fn advantages(
    values: &[Lanes],
    rewards: &[Lanes],
    ends: &[[Option<End>; LANES]],
    credit: Credit,
    advantages: &mut [Lanes],
    returns: &mut [Lanes],
) {
    let (Credit { gamma, lambda }, unit) = (credit, credit.value_unit());
    let mut later = [0.0f32; LANES];
    for t in (0..rewards.len()).rev() {
        for (lane, later) in later.iter_mut().enumerate() {
            let goes_on = if ends[t][lane].is_none() { 1.0 } else { 0.0 };
            let [now, next] = [unit * values[t].0[lane], unit * values[t + 1].0[lane]];
            let surprise = rewards[t].0[lane] + goes_on * gamma * next - now;
            *later = surprise + goes_on * gamma * lambda * *later;
            advantages[t].0[lane] = *later;
            returns[t].0[lane] = (*later + now) / unit;
        }
    }
}

/// Shifts and scales advantages to mean 0 and standard deviation 1.
pub fn normalise<'a>(groups: impl Iterator<Item = &'a mut Vec<Lanes>>) {
    let mut all: Vec<&mut Vec<Lanes>> = groups.collect();
    let values = |all: &[&mut Vec<Lanes>]| all.iter().flat_map(|a| a.iter()).flat_map(|l| l.0).map(f64::from).collect::<Vec<_>>();
    let before = values(&all);
    let n = before.len().max(1) as f64;
    let mean = before.iter().sum::<f64>() / n;
    let std = (before.iter().map(|a| (a - mean).powi(2)).sum::<f64>() / n).sqrt().max(LEAST_SPREAD);
    for lanes in all.iter_mut().flat_map(|a| a.iter_mut()) {
        *lanes = lanes.map(|a| ((f64::from(a) - mean) / std) as f32);
    }
}

/// Where all advantages are the same, none is blown up.
const LEAST_SPREAD: f64 = 1e-8;

#[cfg(test)]
mod tests {
    use super::*;

    /// One lane of each, the others 0.
    fn lanes(values: &[f32]) -> Vec<Lanes> {
        values.iter().map(|v| Lanes::splat(*v)).collect()
    }

    #[test]
    fn advantages_are_discounted_sums_of_surprises_and_stop_at_ends() {
        let credit = Credit { gamma: 0.5, lambda: 0.5 };
        assert_eq!(credit.value_unit(), 2.0);
        let (values, rewards) = (lanes(&[1.0, 2.0, 3.0, 4.0]), lanes(&[1.0, -1.0, 2.0]));
        let mut ends = [[None; LANES]; 3];
        ends[1] = [Some(End::Terminated); LANES];
        let (mut found, mut returns) = (lanes(&[0.0; 3]), lanes(&[0.0; 3]));
        advantages(&values, &rewards, &ends, credit, &mut found, &mut returns);
        // In units of 2: values 2, 4, 6, 8.
        let last = 2.0 + 0.5 * 8.0 - 6.0;
        let ended = -1.0 - 4.0;
        let first = 1.0 + 0.5 * 4.0 - 2.0 + 0.25 * ended;
        assert_eq!(found.iter().map(|a| a.0[3]).collect::<Vec<_>>(), [first, ended, last]);
        assert_eq!(returns[1].0[5], (ended + 4.0) / 2.0);
    }

    #[test]
    fn normalised_advantages_have_mean_0_and_deviation_1() {
        let (mut a, mut b) = (lanes(&[1.0, 5.0]), lanes(&[-3.0]));
        normalise([&mut a, &mut b].into_iter());
        let all = [a[0].0[0], a[1].0[7], b[0].0[2]];
        assert!(all.iter().sum::<f32>().abs() < 1e-6);
        assert!((all.iter().map(|v| v * v).sum::<f32>() / 3.0 - 1.0).abs() < 1e-5, "{all:?}");
        let mut same = lanes(&[2.0, 2.0]);
        normalise([&mut same].into_iter());
        assert_eq!(same[0].0[0], 0.0);
    }
}
