//! What a network sees of a state, and how a gradient comes back through it.

use super::corpus::Corpus;
use super::hand::{Chain, Hand, Vec3, add, cross, sub, turn};
use super::relations::{BLOCK, HAND_WIDTH, Relations, derived_width, relations, vec3};
use super::scaling::Scaling;
use crate::config::FeatureSet;
use crate::nn::{LANES, Lanes, Panels, kernel, panels_of};
use crate::state::{BASE_DIM, JOINTS, MOST_CONTEXT};
use crate::task::Task;
use std::array::from_fn;

/// Spread below which a state entry counts as constant (1 cm, 0.01 rad, 0.01 rad/s, 0.01 of a quaternion).
const STATE_FLOOR: f32 = 0.01;
/// Range of the near features \[m\].
const NEAR_M: f32 = 0.015;

/// Entries of the widest state.
const MOST_STATE: usize = BASE_DIM + MOST_CONTEXT;

/// The map from a state row to a network's inputs: kept state entries, then what kinematics derive, then the near features.
#[derive(Clone, Debug, PartialEq)]
pub struct Features {
    task: Task,
    set: FeatureSet,
    mask_dq: bool,
    kept: Vec<usize>,
    state: Scaling,
    derived: Scaling,
    chain: Chain,
}

impl Features {
    /// Fits the scaling to the transitions of `corpus`.
    pub fn fit(corpus: &Corpus, set: FeatureSet, mask_dq: bool) -> Self {
        let (task, width) = (corpus.task, derived_width(corpus.task, set));
        let state = |r: usize, row: &mut [f32]| row.copy_from_slice(corpus.state(r));
        let derived = |r: usize, row: &mut [f32]| row.copy_from_slice(corpus.relations(r));
        let state = Scaling::fit(corpus.rows(), task.state_dim(), STATE_FLOOR, state);
        let derived = if width == 0 { Scaling::default() } else { Scaling::fit(corpus.rows(), width, STATE_FLOOR, derived) };
        Self::from_scaling(task, set, mask_dq, state, derived)
    }

    /// From known scalings, e.g. those of a file; their widths must be the task's and `derived_width`'s.
    pub fn from_scaling(task: Task, set: FeatureSet, mask_dq: bool, state: Scaling, derived: Scaling) -> Self {
        let kept = (0..task.state_dim()).filter(|i| !(mask_dq && (JOINTS..2 * JOINTS).contains(i))).collect();
        Features { task, set, mask_dq, kept, state, derived, chain: Chain::default() }
    }

    /// The task.
    pub fn task(&self) -> Task {
        self.task
    }

    /// Number of network inputs.
    pub fn width(&self) -> usize {
        self.kept.len() + self.derived.width() + self.near_width()
    }

    fn near_width(&self) -> usize {
        if self.set == FeatureSet::FkNear { self.derived.width() - HAND_WIDTH + 3 } else { 0 }
    }

    /// Statistics of the state entries.
    pub fn state_scaling(&self) -> &Scaling {
        &self.state
    }

    /// Statistics of the derived entries.
    pub fn derived_scaling(&self) -> &Scaling {
        &self.derived
    }

    /// The set, and whether dq is left out.
    pub fn choice(&self) -> (FeatureSet, bool) {
        (self.set, self.mask_dq)
    }

    /// Whether the inputs depend on where the hand is.
    pub fn needs_hand(&self) -> bool {
        self.set != FeatureSet::Raw
    }

    /// Where the hand is in these states; all zeros when these features do not need it.
    pub fn hand(&self, state: &[Lanes]) -> Hand {
        if self.needs_hand() { self.chain.hand(state) } else { Hand::default() }
    }

    /// Writes the inputs of a panel of states into `out` (`width()` entries).
    pub fn forward(&self, state: &[Lanes], hand: &Hand, out: &mut [Lanes]) {
        let related = if self.needs_hand() { relations(self.task, state, hand) } else { Relations::default() };
        self.write(state, &related, out);
    }

    /// As [`Features::forward`], where the relations are known already.
    pub fn write(&self, state: &[Lanes], related: &Relations, out: &mut [Lanes]) {
        let (kept, rest) = out.split_at_mut(self.kept.len());
        for (slot, i) in kept.iter_mut().zip(&self.kept) {
            *slot = state[*i].map(|v| self.state.apply(*i, v));
        }
        let (derived, near) = rest.split_at_mut(self.derived.width());
        for (i, (slot, value)) in derived.iter_mut().zip(related).enumerate() {
            *slot = value.map(|v| self.derived.apply(i, v));
        }
        near.iter_mut().zip(&related[HAND_WIDTH - 3..]).for_each(|(slot, value)| *slot = *value / NEAR_M);
        kernel::tanh(near);
    }

    /// Writes the inputs in `count` transitions of `corpus`, the `i`-th of which is `at(i)`, from the first panel on; zero in lanes without one.
    pub fn write_transitions(&self, corpus: &Corpus, count: usize, at: impl Fn(usize) -> usize, to: &mut Panels) {
        let mut state = [Lanes::default(); MOST_STATE];
        let (state, seen, width) = (&mut state[..self.task.state_dim()], self.width(), derived_width(self.task, FeatureSet::Fk));
        let mut related = Relations::default();
        for p in 0..panels_of(count) {
            let rows: [usize; LANES] = from_fn(|lane| at((p * LANES + lane).min(count - 1)));
            kernel::interleave(state, rows.map(|r| corpus.state(r)));
            if self.needs_hand() {
                kernel::interleave(&mut related[..width], rows.map(|r| corpus.relations(r)));
            }
            self.write(state, &related, &mut to.panel_mut(p)[..seen]);
        }
        to.clear_tail(count);
    }

    /// Adds to `d_state` the gradient that `d_inputs` sends back to the entries of the state that change during an episode;
    /// `inputs` is what [`Features::forward`] wrote.
    pub fn backward(&self, state: &[Lanes], hand: &Hand, inputs: &[Lanes], d_inputs: &[Lanes], d_state: &mut [Lanes]) {
        for (i, d) in self.kept.iter().zip(d_inputs).take_while(|(i, _)| **i < BASE_DIM) {
            d_state[*i] += *d / self.state.std[*i];
        }
        if !self.needs_hand() {
            return;
        }
        let from = self.kept.len();
        let near_from = from + self.derived.width();
        let derived = |at: usize| -> Vec3 { std::array::from_fn(|k| d_inputs[from + at + k] / self.derived.std[at + k]) };
        let near = |at: usize| -> Vec3 {
            let entry = near_from + at;
            if self.near_width() == 0 {
                return Vec3::default();
            }
            let slope = |y: Lanes| Lanes::splat(1.0) - y * y;
            std::array::from_fn(|k| d_inputs[entry + k] * slope(inputs[entry + k]) / NEAR_M)
        };
        // block in hand = R^T (block - tool); its gradient in the world's frame pulls at the block and pushes at the hand
        let pull = turn(&hand.columns, add(derived(9), near(0)));
        let arm = sub(vec3(state, BLOCK), hand.tool);
        let force = sub(derived(0), pull);
        let turns = add(cross(hand.columns[0], derived(3)), cross(hand.columns[1], derived(6)));
        hand.add_joint_gradient(force, sub(turns, cross(arm, pull)), d_state);
        let mut d_block = pull;
        if self.task != Task::PickUp {
            d_block = sub(d_block, add(derived(HAND_WIDTH), near(3)));
        }
        d_state[BLOCK..].iter_mut().zip(d_block).for_each(|(slot, d)| *slot += d);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::Demo;
    use crate::learn::tests::testing::{demo, random_states};

    #[test]
    fn features_gradients_equal_finite_differences() {
        for (task, set, mask_dq) in [
            (Task::PickUp, FeatureSet::FkNear, false),
            (Task::PickAndPlace, FeatureSet::Fk, true),
            (Task::Stack, FeatureSet::FkNear, true),
            (Task::Stack, FeatureSet::Raw, false),
        ] {
            let states = random_states(task, 20, 7);
            let still = vec![0.0; 19 * JOINTS];
            let demo = Demo::new(task, states.clone(), still.clone(), still).expect("lengths match");
            let features = Features::fit(&Corpus::new(&[demo], "training").expect("a demo"), set, mask_dq);
            let state: Vec<Lanes> = states[..task.state_dim()].iter().map(|v| Lanes::splat(*v)).collect();
            let weights: Vec<Lanes> = (0..features.width()).map(|i| Lanes::splat(((i * 29 % 13) as f32 - 6.0) / 6.0)).collect();
            let loss = |state: &[Lanes]| -> f64 {
                let mut out = vec![Lanes::default(); features.width()];
                features.forward(state, &features.hand(state), &mut out);
                out.iter().zip(&weights).map(|(o, w)| f64::from((*o * *w).0[3])).sum()
            };
            let mut inputs = vec![Lanes::default(); features.width()];
            features.forward(&state, &features.hand(&state), &mut inputs);
            let mut gradient = vec![Lanes::default(); BASE_DIM];
            features.backward(&state, &features.hand(&state), &inputs, &weights, &mut gradient);
            for (i, analytic) in gradient.iter().map(|d| d.0[3]).enumerate() {
                let h = 1e-3;
                let at = |sign: f32| {
                    let mut moved = state.clone();
                    moved[i] += Lanes::splat(sign * h);
                    loss(&moved)
                };
                let numeric = (at(1.0) - at(-1.0)) / f64::from(2.0 * h);
                let error = (numeric - f64::from(analytic)).abs();
                assert!(error < 0.02 * (1.0 + numeric.abs()), "{task} {set:?} entry {i}: {analytic} against {numeric}");
            }
        }
    }

    #[test]
    fn masking_leaves_out_the_nine_velocities() {
        let demo = demo(Task::Stack, 30, 1);
        let corpus = Corpus::new(&[demo], "training").expect("a demo");
        let width = |mask| Features::fit(&corpus, FeatureSet::FkNear, mask).width();
        assert_eq!(width(false), 32 + 15 + 6);
        assert_eq!(width(true), width(false) - JOINTS);
    }
}
