//! f_phi: the next state from a state and the action that the motors were given.

use super::corpus::Corpus;
use super::features::Features;
use super::older;
use super::scaling::Scaling;
use super::weights::{Reader, push_features, push_network, push_scaling};
use crate::config::{PretrainSettings, Structure};
use crate::layout::Layout;
use crate::nn::{Lanes, Mlp, Pass};
use crate::tensor::NamedTensor;
use rand::Rng;
use serde_json::{Value, json};
use std::ops::{Add, Mul};
use std::sync::Arc;

/// Spread of an action below which it counts as constant \[rad/s\].
const ACTION_FLOOR_RAD_S: f32 = 0.01;
/// Spread of a change in one step below which it counts as noise (0.1 mm, 0.1 mrad, 0.1 mrad/s; where the unit is not known, this share of the
/// state's own spread).
pub const STEP_FLOOR: f32 = 1e-4;

/// What an entry of a state is known to become in a control step, before anything is learned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Known {
    /// What it is.
    Stays,
    /// A joint's angle: it integrates the command with this number.
    Integrates(usize),
    /// A joint's velocity: the command with this number.
    Follows(usize),
}

/// Of each entry that may change.
fn known(layout: &Layout, structure: Structure) -> Vec<Known> {
    let (positions, velocities) = (layout.positions(), layout.velocities());
    let of = |i: usize| match structure {
        Structure::Kinematic if positions.contains(&i) => Known::Integrates(i - positions.start),
        Structure::Kinematic if velocities.contains(&i) => Known::Follows(i - velocities.start),
        _ => Known::Stays,
    };
    (0..layout.changing()).map(of).collect()
}

/// f_phi with everything needed to run it: s' = s + known change + network, entry by entry; the constants of an episode are copied.
/// The predicted quaternion is not normalised again: over the steps of one segment it leaves unit length by less than the loss sees.
#[derive(Clone, Debug, PartialEq)]
pub struct Dynamics {
    layout: Arc<Layout>,
    structure: Structure,
    known: Vec<Known>,
    features: Features,
    action: Scaling,
    residual: Scaling,
    pub(in crate::learn) net: Mlp,
    settings: PretrainSettings,
}

impl Dynamics {
    /// A network with random weights; scalings from the training demos.
    pub(in crate::learn) fn new(corpus: &Corpus, settings: &PretrainSettings, rng: &mut impl Rng) -> Self {
        let (layout, features) = (&corpus.layout, Features::fit(corpus, settings.features, false));
        let (changing, action_dim) = (layout.changing(), layout.action_dim());
        let mut widths = vec![settings.hidden_units; settings.hidden_layers + 2];
        (widths[0], widths[settings.hidden_layers + 1]) = (features.width() + action_dim, changing);
        let mut dynamics = Dynamics {
            layout: Arc::clone(layout),
            structure: settings.structure,
            known: known(layout, settings.structure),
            features,
            action: Scaling::fit(
                corpus.rows(),
                action_dim,
                |i| layout.action_unit(i).map_or(0.0, |unit| ACTION_FLOOR_RAD_S * unit),
                |r, row| row.copy_from_slice(corpus.executed(r)),
            ),
            residual: Scaling { mean: vec![0.0; changing], std: vec![1.0; changing] },
            net: Mlp::new(&widths, settings.activation, rng),
            settings: settings.clone(),
        };
        dynamics.residual = Scaling::fit(
            corpus.rows(),
            changing,
            |i| STEP_FLOOR * layout.state_unit(i).unwrap_or(dynamics.features.state_scaling().std[i]),
            |r, row| {
                let (state, action, next) = (corpus.state(r), corpus.executed(r), corpus.next(r));
                row.iter_mut().enumerate().for_each(|(i, v)| *v = next[i] - dynamics.known_next(i, state[i], |k| action[k]));
            },
        );
        dynamics
    }

    /// What the rows that it was trained on hold.
    pub fn layout(&self) -> &Arc<Layout> {
        &self.layout
    }

    /// The settings it was trained with.
    pub fn settings(&self) -> &PretrainSettings {
        &self.settings
    }

    pub(in crate::learn) fn features(&self) -> &Features {
        &self.features
    }

    pub(in crate::learn) fn action_scaling(&self) -> &Scaling {
        &self.action
    }

    pub(in crate::learn) fn residual_scaling(&self) -> &Scaling {
        &self.residual
    }

    /// Duration of a control step \[s\].
    pub(in crate::learn) fn dt_s(&self) -> f32 {
        self.layout.period_s as f32
    }

    /// Whether joints are known to integrate their commands.
    pub(in crate::learn) fn is_kinematic(&self) -> bool {
        self.structure == Structure::Kinematic
    }

    /// The network's inputs for a panel of states and actions.
    pub(in crate::learn) fn write_inputs(&self, state: &[Lanes], action: &[Lanes], out: &mut [Lanes]) {
        let (seen, given) = out.split_at_mut(self.features.width());
        self.features.forward(state, &self.features.hand(state), seen);
        self.write_action(action, given);
    }

    /// The last inputs.
    pub(in crate::learn) fn write_action(&self, action: &[Lanes], given: &mut [Lanes]) {
        given.copy_from_slice(action);
        self.scale_action(given);
    }

    /// Actions become inputs, in their place.
    pub(in crate::learn) fn scale_action(&self, given: &mut [Lanes]) {
        given.iter_mut().enumerate().for_each(|(i, slot)| *slot = slot.map(|a| self.action.apply(i, a)));
    }

    /// What entry `i` of a state, or of a panel of them, is known to become before learning; `action` gives a command.
    #[inline]
    fn known_next<T: Add<Output = T> + Mul<f32, Output = T>>(&self, i: usize, state: T, action: impl Fn(usize) -> T) -> T {
        match self.known[i] {
            Known::Integrates(k) => state + action(k) * self.dt_s(),
            Known::Follows(k) => action(k),
            Known::Stays => state,
        }
    }

    /// Gradient with respect to states, but for the network's part, from that with respect to the next states: in place, as every entry
    /// is known to stay, except that a kinematic structure does not look at dq.
    pub(in crate::learn) fn known_backward(&self, d_state: &mut [Lanes]) {
        if self.is_kinematic() {
            d_state[self.layout.velocities()].fill(Lanes::default());
        }
    }

    /// The next states' changing entries from the network's output.
    pub(in crate::learn) fn write_next(&self, state: &[Lanes], action: &[Lanes], output: &[Lanes], next: &mut [Lanes]) {
        for (i, slot) in next.iter_mut().enumerate() {
            *slot = self.known_next(i, state[i], |k| action[k]) + output[i].map(|output| self.residual.undo(i, output));
        }
    }

    /// What the network must put out for entry `i` of an observed next state.
    #[inline]
    pub(in crate::learn) fn residual(&self, i: usize, state: &[f32], action: &[f32], next: &[f32]) -> f32 {
        self.residual.apply(i, next[i] - self.known_next(i, state[i], |k| action[k]))
    }

    /// Predicted next state row after `action` in `state_row`.
    ///
    /// # Panics
    /// When a row is not the layout's.
    pub fn predict(&self, state_row: &[f32], action: &[f32]) -> Vec<f32> {
        let (dims, wanted) = ((state_row.len(), action.len()), (self.layout.state_dim(), self.layout.action_dim()));
        assert_eq!(dims, wanted, "the rows of another task than {}", self.layout.name);
        let action: Vec<Lanes> = action.iter().map(|v| Lanes::splat(*v)).collect();
        let mut state: Vec<Lanes> = state_row.iter().map(|v| Lanes::splat(*v)).collect();
        self.step(&mut state, &action, &mut Pass::new(&self.net, 1));
        state.iter().map(|entry| entry.0[0]).collect()
    }

    /// A panel of states becomes the next ones; `pass` has room for one panel.
    pub(in crate::learn) fn step(&self, state: &mut [Lanes], action: &[Lanes], pass: &mut Pass) {
        self.write_inputs(state, action, pass.input.panel_mut(0));
        self.net.forward(pass, 0..1);
        let mut next = vec![Lanes::default(); self.known.len()];
        self.write_next(state, action, pass.output.panel(0), &mut next);
        state[..next.len()].copy_from_slice(&next);
    }

    /// What the network's inputs are called, in order: those of its features, then the action's entries.
    fn input_names(&self) -> Vec<String> {
        let mut names = self.features.names();
        names.extend(self.layout.action_entries().cloned());
        names
    }

    /// All arrays.
    pub fn to_tensors(&self) -> Vec<NamedTensor> {
        let mut out = Vec::new();
        push_features(&mut out, "dynamics", &self.features);
        push_scaling(&mut out, "dynamics.action", &self.action);
        push_scaling(&mut out, "dynamics.residual", &self.residual);
        push_network(&mut out, "dynamics", &self.net);
        out
    }

    /// All that is not an array.
    pub fn meta(&self) -> Value {
        let (features, mask_dq) = self.features.choice();
        let widths = self.net.widths();
        json!({
            "network": "dynamics",
            "task": self.layout.name,
            "state_dim": self.layout.state_dim(),
            "layout": *self.layout,
            "features": features,
            "mask_dq": mask_dq,
            "inputs": self.input_names(),
            "structure": self.structure,
            "activation": self.net.activation(),
            "hidden": &widths[1..widths.len() - 1],
            "settings": self.settings,
        })
    }

    /// The inverse of [`Dynamics::to_tensors`] and [`Dynamics::meta`].
    ///
    /// # Errors
    /// Says what is missing or does not fit, with both numbers.
    pub fn from_tensors(tensors: &[NamedTensor], meta: &Value) -> Result<Self, String> {
        let reader = Reader { tensors, meta };
        let layout = reader.layout("dynamics")?;
        let settings: PretrainSettings = reader.settings(older::of_dynamics)?;
        settings.validate().map_err(|why| format!("its settings cannot have trained it: {why}"))?;
        let features = reader.features("dynamics", &layout)?;
        let (changing, action_dim) = (layout.changing(), layout.action_dim());
        let net = reader.network("dynamics", features.width() + action_dim, changing)?;
        let structure = reader.meta("structure")?;
        let dynamics = Dynamics {
            structure,
            known: known(&layout, structure),
            features,
            action: reader.scaling("dynamics.action", action_dim)?,
            residual: reader.scaling("dynamics.residual", changing)?,
            layout,
            net,
            settings,
        };
        reader.inputs(&dynamics.input_names())?;
        Ok(dynamics)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::models::{ModelSamples, Samples};
    use crate::learn::tests::testing::{BASE_DIM, JOINTS, Toy, demos};
    use crate::seed::stream;

    #[test]
    fn dynamics_survive_their_tensors_and_copy_the_context() {
        let corpus = Corpus::new(demos(Toy::Stack, 3, 20, 0), "training").expect("demos");
        for structure in [Structure::Plain, Structure::Kinematic] {
            let settings = PretrainSettings { structure, ..Default::default() };
            let dynamics = Dynamics::new(&corpus, &settings, &mut stream(0, "test", 0));
            let back = Dynamics::from_tensors(&dynamics.to_tensors(), &dynamics.meta());
            assert_eq!(back.as_ref(), Ok(&dynamics));
            let next = dynamics.predict(corpus.state(4), &[0.1; JOINTS]);
            let constants = corpus.layout.changing()..;
            assert_eq!(next[constants.clone()], corpus.state(4)[constants]);
        }
    }

    #[test]
    fn a_description_out_of_its_limits_is_refused() {
        let corpus = Corpus::new(demos(Toy::Stack, 3, 20, 0), "training").expect("demos");
        let dynamics = Dynamics::new(&corpus, &PretrainSettings::default(), &mut stream(0, "test", 0));
        for (key, value, said) in [
            ("hidden", json!([0]), "is [0]: networks have 1 to 16 hidden layers of 1 to 4096 units"),
            ("settings", json!({ "hidden_units": u64::MAX }), "its settings cannot have trained it"),
            ("settings", json!({ "ensemble": 5 }), "pretrain.ensemble = 5, which hilt no longer has"),
            ("settings", json!({ "steps": 1, "ensembles": 1 }), "unknown field `ensembles`"),
        ] {
            let mut meta = dynamics.meta();
            meta[key] = value;
            let message = Dynamics::from_tensors(&dynamics.to_tensors(), &meta).expect_err(key);
            assert!(message.contains(said), "{key}: {message}");
        }
    }

    #[test]
    fn a_network_of_an_older_version_is_read() {
        let corpus = Corpus::new(demos(Toy::Stack, 3, 20, 0), "training").expect("demos");
        let dynamics = Dynamics::new(&corpus, &PretrainSettings::default(), &mut stream(0, "test", 0));
        let mut meta = dynamics.meta();
        (meta["settings"]["steps"], meta["settings"]["ensemble"]) = (json!(1), json!(1));
        assert_eq!(Dynamics::from_tensors(&dynamics.to_tensors(), &meta).as_ref(), Ok(&dynamics));
    }

    #[test]
    fn the_target_undoes_the_prediction() {
        let corpus = Corpus::new(demos(Toy::PickUp, 2, 20, 0), "training").expect("demos");
        let dynamics = Dynamics::new(&corpus, &PretrainSettings::default(), &mut stream(0, "test", 0));
        let (mut next, mut output) = ([Lanes::default(); BASE_DIM], [Lanes::default(); BASE_DIM]);
        ModelSamples { corpus: &corpus, dynamics: &dynamics }.write_targets(&[7], &mut output);
        let splat = |row: &[f32]| -> Vec<Lanes> { row.iter().map(|v| Lanes::splat(*v)).collect() };
        dynamics.write_next(&splat(corpus.state(7)), &splat(corpus.executed(7)), &output, &mut next);
        for (a, b) in next.iter().zip(corpus.next(7)) {
            assert!((a.0[0] - b).abs() < 1e-6, "{a:?} against {b}");
        }
    }
}
