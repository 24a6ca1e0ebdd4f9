//! Running statistics of what the worlds have shown: the scalings of the policy's inputs.

use crate::config::FeatureSet;
use crate::layout::Layout;
use crate::learn::models::{Features, Scaling, derived_width};
use crate::nn::Lanes;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Smallest standard deviation of an entry (5 cm, 0.05 rad, 0.05 rad/s): before learning nothing moves the block, and what has not moved
/// yet must not be blown up.
const FLOOR: f64 = 0.05;

/// What the policy sees of a state, before it is scaled.
#[derive(Clone, Debug, PartialEq)]
pub struct Sight {
    /// What a state holds.
    pub layout: Arc<Layout>,
    /// What the policy sees of the state.
    pub set: FeatureSet,
    /// Whether joint velocities are hidden.
    pub mask_dq: bool,
}

impl Sight {
    /// Entries of a state, then what kinematics derive.
    fn widths(&self) -> [usize; 2] {
        [self.layout.state_dim(), derived_width(&self.layout, self.set)]
    }

    fn width(&self) -> usize {
        self.widths().iter().sum()
    }
}

/// Mean and sum of squares about it of every entry, over all steps of all worlds so far.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Statistics {
    count: f64,
    mean: Vec<f64>,
    squares: Vec<f64>,
}

impl Statistics {
    /// Nothing seen yet.
    pub fn new(sight: &Sight) -> Self {
        Statistics { count: 0.0, mean: vec![0.0; sight.width()], squares: vec![0.0; sight.width()] }
    }

    /// Whether they can be those of `sight`, as read from a file.
    pub fn fit(&self, sight: &Sight) -> bool {
        let numbers = || self.mean.iter().chain(&self.squares);
        let lengths = self.mean.len() == sight.width() && self.squares.len() == sight.width();
        lengths && self.count >= 1.0 && numbers().all(|v| v.is_finite()) && self.squares.iter().all(|v| *v >= 0.0)
    }

    /// The features with these scalings.
    pub fn features(&self, sight: &Sight) -> Features {
        let [state, derived] = sight.widths();
        let std = |i: usize| {
            let floor = FLOOR * f64::from(sight.layout.state_unit(i).unwrap_or(1.0));
            (self.squares[i] / self.count.max(1.0)).sqrt().max(floor) as f32
        };
        let scaling = |range: std::ops::Range<usize>| Scaling {
            mean: self.mean[range.clone()].iter().map(|m| *m as f32).collect(),
            std: range.map(std).collect(),
        };
        Features::from_scaling(&sight.layout, sight.set, sight.mask_dq, scaling(0..state), scaling(state..state + derived))
    }

    /// Sums that are to be taken in.
    pub fn sums(&self) -> Sums {
        let width = self.mean.len();
        Sums { rows: 0, about: self.mean.clone(), sum: vec![0.0; width], square: vec![0.0; width] }
    }

    /// Takes in what [`Statistics::sums`] has been filled with.
    pub fn absorb(&mut self, sums: &Sums) {
        if sums.rows == 0 {
            return;
        }
        let (rows, all) = (sums.rows as f64, self.count + sums.rows as f64);
        for (i, (mean, squares)) in self.mean.iter_mut().zip(&mut self.squares).enumerate() {
            let there = sums.about[i] + sums.sum[i] / rows;
            let apart = there - *mean;
            *squares += (sums.square[i] - sums.sum[i] * sums.sum[i] / rows).max(0.0) + apart * apart * self.count * rows / all;
            *mean += apart * rows / all;
        }
        self.count = all;
    }
}

/// Sums over the steps of a few worlds, about the mean that was known before them.
#[derive(Clone, Debug, Default)]
pub struct Sums {
    rows: u64,
    about: Vec<f64>,
    sum: Vec<f64>,
    square: Vec<f64>,
}

impl Sums {
    /// Adds the first `lanes` rows of a panel: its state and what is derived from it.
    fn add(&mut self, state: &[Lanes], derived: &[Lanes], lanes: usize) {
        self.rows += lanes as u64;
        let entries = state.iter().chain(derived).zip(&self.about);
        for ((entry, about), (sum, square)) in entries.zip(self.sum.iter_mut().zip(&mut self.square)) {
            for value in &entry.0[..lanes] {
                let apart = f64::from(*value) - about;
                *sum += apart;
                *square += apart * apart;
            }
        }
    }
}

/// Writes the inputs of a panel of states into `out`; its first `lanes` rows go into the sums.
pub fn look(features: &Features, state: &[Lanes], out: &mut [Lanes], sums: &mut Sums, lanes: usize) {
    let related = features.relations(state, &features.hand(state));
    sums.add(state, &related[..features.derived_scaling().width()], lanes);
    features.write(state, &related, out);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::tests::testing::{Toy, random_states};
    use crate::nn::{LANES, kernel};

    #[test]
    fn sums_taken_in_one_after_another_are_the_statistics_of_all() {
        let sight = Sight { layout: Toy::Stack.layout(), set: FeatureSet::FkNear, mask_dq: false };
        let (dim, rows) = (Toy::Stack.layout().state_dim(), 5 * LANES);
        let states = random_states(Toy::Stack, rows, 3);
        let mut statistics = Statistics::new(&sight);
        for part in [0..LANES, LANES..4 * LANES, 4 * LANES..5 * LANES] {
            let (features, mut sums) = (statistics.features(&sight), statistics.sums());
            for first in part.step_by(LANES) {
                let mut state = vec![Lanes::default(); dim];
                kernel::interleave(&mut state, std::array::from_fn(|lane| &states[(first + lane) * dim..][..dim]));
                let mut out = vec![Lanes::default(); features.width()];
                look(&features, &state, &mut out, &mut sums, LANES);
            }
            statistics.absorb(&sums);
        }
        let whole = Scaling::fit(rows, dim, |_| FLOOR as f32, |r, row| row.copy_from_slice(&states[r * dim..][..dim]));
        let features = statistics.features(&sight);
        let close = |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5);
        assert!(close(&features.state_scaling().mean, &whole.mean) && close(&features.state_scaling().std, &whole.std));
        assert!(statistics.fit(&sight) && !statistics.fit(&Sight { set: FeatureSet::Raw, ..sight }));
    }
}
