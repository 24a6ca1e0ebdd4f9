//! What a network sees of a state, and how a gradient comes back through it.

use super::corpus::Corpus;
use super::hand::{Hand, Vec3};
use super::names::{near_names, relation_names};
use super::relations::{Relating, Relations, UNRELATED};
use super::scaling::Scaling;
use crate::config::FeatureSet;
use crate::layout::Layout;
use crate::nn::{LANES, Lanes, Panels, kernel, panels_of};
use std::array::from_fn;
use std::sync::Arc;

/// Spread below which a state entry counts as constant (1 cm, 0.01 rad, 0.01 rad/s, 0.01 of a quaternion).
const STATE_FLOOR: f32 = 0.01;
/// Range of the near features \[m\]: each is tanh(distance / range).
pub const NEAR_M: f32 = 0.015;

/// The map from a state row to a network's inputs: kept state entries, then what kinematics derive, then the near features.
#[derive(Clone, Debug, PartialEq)]
pub struct Features {
    layout: Arc<Layout>,
    set: FeatureSet,
    mask_dq: bool,
    kept: Vec<usize>,
    state: Scaling,
    derived: Scaling,
    relating: Relating,
}

/// Number of derived entries of a feature set.
pub fn derived_width(layout: &Layout, set: FeatureSet) -> usize {
    if set == FeatureSet::Raw { 0 } else { Relating::new(layout).width() }
}

impl Features {
    /// Fits the scaling to the transitions of `corpus`.
    pub fn fit(corpus: &Corpus, set: FeatureSet, mask_dq: bool) -> Self {
        let (layout, width) = (&corpus.layout, derived_width(&corpus.layout, set));
        let state = |r: usize, row: &mut [f32]| row.copy_from_slice(corpus.state(r));
        let derived = |r: usize, row: &mut [f32]| row.copy_from_slice(corpus.relations(r));
        let state = Scaling::fit(
            corpus.rows(),
            layout.state_dim(),
            |i| layout.state_unit(i).map_or(0.0, |unit| STATE_FLOOR * unit),
            state,
        );
        let derived = if width == 0 { Scaling::default() } else { Scaling::fit(corpus.rows(), width, |_| STATE_FLOOR, derived) };
        Self::from_scaling(layout, set, mask_dq, state, derived)
    }

    /// From known scalings, e.g. those of a file; their widths must be the layout's and [`derived_width`]'s.
    pub fn from_scaling(layout: &Arc<Layout>, set: FeatureSet, mask_dq: bool, state: Scaling, derived: Scaling) -> Self {
        let kept = (0..layout.state_dim()).filter(|i| !(mask_dq && layout.velocities().contains(i))).collect();
        Features { layout: Arc::clone(layout), set, mask_dq, kept, state, derived, relating: Relating::new(layout) }
    }

    /// What the rows hold.
    pub fn layout(&self) -> &Arc<Layout> {
        &self.layout
    }

    /// Number of network inputs.
    pub fn width(&self) -> usize {
        self.kept.len() + self.derived.width() + self.near_width()
    }

    /// What the inputs are called, in order.
    pub fn names(&self) -> Vec<String> {
        let state: Vec<&String> = self.layout.state_entries().collect();
        let mut names: Vec<String> = self.kept.iter().map(|i| state[*i].clone()).collect();
        let relations = if self.needs_hand() { relation_names(&self.layout) } else { Vec::new() };
        let near = if self.near_width() > 0 { near_names(&relations) } else { Vec::new() };
        names.extend(relations.into_iter().chain(near));
        names
    }

    /// The entries of the state that are inputs.
    pub fn kept(&self) -> &[usize] {
        &self.kept
    }

    /// Number of near features: of the last of what is derived.
    pub fn near_width(&self) -> usize {
        if self.set == FeatureSet::FkNear { self.relating.near_width() } else { 0 }
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
        self.derived.width() > 0
    }

    /// Where the hand is in these states; all zeros when these features do not need it.
    pub fn hand(&self, state: &[Lanes]) -> Hand {
        if self.needs_hand() { self.relating.hand(state) } else { Hand::default() }
    }

    /// What kinematics derive from these states; nothing when these features do not need it.
    pub fn relations(&self, state: &[Lanes], hand: &Hand) -> Relations {
        if self.needs_hand() { self.relating.relations(state, hand) } else { UNRELATED }
    }

    /// Writes the inputs of a panel of states into `out` (`width()` entries).
    pub fn forward(&self, state: &[Lanes], hand: &Hand, out: &mut [Lanes]) {
        self.write(state, &self.relations(state, hand), out);
    }

    /// As [`Features::forward`], where the relations are known already.
    pub fn write(&self, state: &[Lanes], related: &Relations, out: &mut [Lanes]) {
        self.write_with(|i| state[i], related, out);
    }

    /// The same, where `state` gives an entry of the states.
    fn write_with(&self, state: impl Fn(usize) -> Lanes, related: &Relations, out: &mut [Lanes]) {
        let (kept, rest) = out.split_at_mut(self.kept.len());
        for (slot, i) in kept.iter_mut().zip(&self.kept) {
            *slot = state(*i).map(|v| self.state.apply(*i, v));
        }
        let (derived, near) = rest.split_at_mut(self.derived.width());
        for (i, (slot, value)) in derived.iter_mut().zip(related).enumerate() {
            *slot = value.map(|v| self.derived.apply(i, v));
        }
        near.iter_mut()
            .zip(&related[self.derived.width() - self.near_width()..])
            .for_each(|(slot, value)| *slot = *value / NEAR_M);
        kernel::tanh(near);
    }

    /// Writes the inputs in `count` transitions of `corpus`, the `i`-th of which is `at(i)`, from the first panel on; zero in lanes without one.
    pub fn write_transitions(&self, corpus: &Corpus, count: usize, at: impl Fn(usize) -> usize, to: &mut Panels) {
        let (seen, width) = (self.width(), self.derived.width());
        let mut related = UNRELATED;
        for p in 0..panels_of(count) {
            let rows: [usize; LANES] = from_fn(|lane| at((p * LANES + lane).min(count - 1)));
            if self.needs_hand() {
                kernel::interleave(&mut related[..width], rows.map(|r| corpus.relations(r)));
            }
            let states = rows.map(|r| corpus.state(r));
            self.write_with(|i| Lanes(states.map(|row| row[i])), &related, &mut to.panel_mut(p)[..seen]);
        }
        to.clear_tail(count);
    }

    /// Adds to `d_state` the gradient that `d_inputs` sends back to the entries of the state that change during an episode;
    /// `inputs` is what [`Features::forward`] wrote.
    pub fn backward(&self, state: &[Lanes], hand: &Hand, inputs: &[Lanes], d_inputs: &[Lanes], d_state: &mut [Lanes]) {
        for (i, d) in self.kept.iter().zip(d_inputs).take_while(|(i, _)| **i < self.relating.changing) {
            d_state[*i] += *d / self.state.std[*i];
        }
        if !self.needs_hand() {
            return;
        }
        let (from, width, near_width) = (self.kept.len(), self.derived.width(), self.near_width());
        let slope = |y: Lanes| Lanes::splat(1.0) - y * y;
        let entry = |at: usize| {
            let derived = d_inputs[from + at] / self.derived.std[at];
            if at + near_width < width {
                return derived;
            }
            let near = from + at + near_width;
            derived + d_inputs[near] * slope(inputs[near]) / NEAR_M
        };
        self.relating.backward(state, hand, &|at| -> Vec3 { from_fn(|k| entry(at + k)) }, d_state);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::Demo;
    use crate::layout::{POINT_DIM, POSE_DIM};
    use crate::learn::tests::testing::{BASE_DIM, JOINTS, Toy, demo, random_states};

    #[test]
    fn features_gradients_equal_finite_differences() {
        for (toy, set, mask_dq) in [
            (Toy::PickUp, FeatureSet::FkNear, false),
            (Toy::PickAndPlace, FeatureSet::Fk, true),
            (Toy::Stack, FeatureSet::FkNear, true),
            (Toy::Stack, FeatureSet::Raw, false),
            (Toy::Tower, FeatureSet::FkNear, false),
        ] {
            let states = random_states(toy, 20, 7);
            let still = vec![0.0; 19 * toy.layout().action_dim()];
            let demo = Demo::new(&toy.layout(), states.clone(), still.clone(), still).expect("lengths match");
            let features = Features::fit(&Corpus::new(&[demo], "training").expect("a demo"), set, mask_dq);
            let state: Vec<Lanes> = states[..toy.layout().state_dim()].iter().map(|v| Lanes::splat(*v)).collect();
            let weights: Vec<Lanes> = (0..features.width()).map(|i| Lanes::splat(((i * 29 % 13) as f32 - 6.0) / 6.0)).collect();
            let loss = |state: &[Lanes]| -> f64 {
                let mut out = vec![Lanes::default(); features.width()];
                features.forward(state, &features.hand(state), &mut out);
                out.iter().zip(&weights).map(|(o, w)| f64::from((*o * *w).0[3])).sum()
            };
            let mut inputs = vec![Lanes::default(); features.width()];
            features.forward(&state, &features.hand(&state), &mut inputs);
            let mut gradient = vec![Lanes::default(); toy.layout().changing()];
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
                assert!(error < 0.02 * (1.0 + numeric.abs()), "{toy:?} {set:?} entry {i}: {analytic} against {numeric}");
            }
        }
    }

    #[test]
    fn every_input_has_a_name_of_its_own() {
        let corpus = |toy| Corpus::new(&[demo(toy, 30, 1)], "training").expect("a demo");
        for toy in [Toy::PickUp, Toy::PickAndPlace, Toy::Stack, Toy::Tower] {
            for (set, mask_dq) in [(FeatureSet::Raw, false), (FeatureSet::Fk, true), (FeatureSet::FkNear, false)] {
                let features = Features::fit(&corpus(toy), set, mask_dq);
                let names: std::collections::BTreeSet<String> = features.names().into_iter().collect();
                assert_eq!((names.len(), features.names().len()), (features.width(), features.width()), "{toy:?} {set:?}");
            }
        }
        let names = Features::fit(&corpus(Toy::Tower), FeatureSet::FkNear, true).names();
        let place = |name: &str| names.iter().position(|n| n == name).unwrap_or_else(|| panic!("{name} is none of {names:?}"));
        let state = BASE_DIM - JOINTS + POSE_DIM + POINT_DIM;
        assert_eq!(place("q.0"), 0);
        assert_eq!(place("hand.tool.x_m"), state);
        assert_eq!(place("hand.y_axis.z"), state + 8);
        assert_eq!(place("other.in_hand.x_m"), state + 12);
        assert_eq!(place("block.to_other.z_m"), state + 17);
        assert_eq!(place("block.in_hand.x_near"), state + 21);
        assert_eq!(place("other.to_goal.z_near"), names.len() - 1);
    }

    #[test]
    fn masking_leaves_out_the_velocities() {
        let demo = demo(Toy::Stack, 30, 1);
        let corpus = Corpus::new(&[demo], "training").expect("a demo");
        let width = |mask| Features::fit(&corpus, FeatureSet::FkNear, mask).width();
        assert_eq!(width(false), 28 + 15 + 6);
        assert_eq!(width(true), width(false) - JOINTS);
    }
}
