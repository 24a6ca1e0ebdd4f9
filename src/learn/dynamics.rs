//! f_phi: the next state from a state and the action that the motors were given.

use super::corpus::Corpus;
use super::features::Features;
use super::scaling::Scaling;
use super::weights::{Reader, push_features, push_network, push_scaling};
use crate::config::{PretrainSettings, Structure};
use crate::nn::{Lanes, Mlp, Pass};
use crate::state::{Action, BASE_DIM, CONTROL_DT_S, JOINTS};
use crate::tasks::Task;
use crate::tensor::NamedTensor;
use rand::Rng;
use serde_json::{Value, json};

/// Spread of an action below which it counts as constant \[rad/s\].
const ACTION_FLOOR_RAD_S: f32 = 0.01;
/// Spread of a change in one step below which it counts as noise (0.1 mm, 0.1 mrad, 0.1 mrad/s).
pub(super) const STEP_FLOOR: f32 = 1e-4;
/// Duration of a control step \[s\].
pub(super) const DT_S: f32 = CONTROL_DT_S as f32;

/// f_phi with everything needed to run it: s' = s + known change + network, entry by entry; the constants of an episode are copied.
/// The predicted quaternion is not normalised again: over the steps of one segment it leaves unit length by less than the loss sees.
#[derive(Clone, Debug, PartialEq)]
pub struct Dynamics {
    task: Task,
    structure: Structure,
    features: Features,
    action: Scaling,
    residual: Scaling,
    /// The network in use.
    pub(super) net: Mlp,
    /// The others of an ensemble (`pretrain.ensemble`), which take their turns.
    pub(super) others: Vec<Mlp>,
    settings: PretrainSettings,
}

impl Dynamics {
    /// A network with random weights; scalings from the training demos.
    pub(super) fn new(corpus: &Corpus, settings: &PretrainSettings, rng: &mut impl Rng) -> Self {
        let features = Features::fit(corpus, settings.features, false);
        let mut widths = vec![settings.hidden_units; settings.hidden_layers + 2];
        (widths[0], widths[settings.hidden_layers + 1]) = (features.width() + JOINTS, BASE_DIM);
        let mut dynamics = Dynamics {
            task: corpus.task,
            structure: settings.structure,
            features,
            action: Scaling::fit(corpus.rows(), JOINTS, ACTION_FLOOR_RAD_S, |r, row| row.copy_from_slice(corpus.executed(r))),
            residual: Scaling { mean: vec![0.0; BASE_DIM], std: vec![1.0; BASE_DIM] },
            net: Mlp::new(&widths, settings.activation, rng),
            others: Vec::new(),
            settings: settings.clone(),
        };
        dynamics.residual = Scaling::fit(corpus.rows(), BASE_DIM, STEP_FLOOR, |r, row| {
            let (state, action, next) = (corpus.state(r), corpus.executed(r), corpus.next(r));
            row.iter_mut().enumerate().for_each(|(i, v)| *v = next[i] - dynamics.known_next(i, state[i], action[i % JOINTS]));
        });
        dynamics
    }

    /// A further network with random weights, put into use.
    pub(super) fn add_member(&mut self, rng: &mut impl Rng) {
        let fresh = Mlp::new(self.net.widths(), self.net.activation(), rng);
        self.others.push(std::mem::replace(&mut self.net, fresh));
    }

    /// The next network of the ensemble is in use, the present one comes last.
    pub(super) fn turn(&mut self) {
        if let Some(next) = self.others.first_mut() {
            std::mem::swap(&mut self.net, next);
            self.others.rotate_left(1);
        }
    }

    /// The task it was trained on.
    pub fn task(&self) -> Task {
        self.task
    }

    /// The settings it was trained with.
    pub fn settings(&self) -> &PretrainSettings {
        &self.settings
    }

    pub(super) fn features(&self) -> &Features {
        &self.features
    }

    pub(super) fn action_scaling(&self) -> &Scaling {
        &self.action
    }

    pub(super) fn residual_scaling(&self) -> &Scaling {
        &self.residual
    }

    pub(super) fn structure(&self) -> Structure {
        self.structure
    }

    /// The network's inputs for a panel of states and actions \[rad/s\].
    pub(super) fn write_inputs(&self, state: &[Lanes], action: &[Lanes], out: &mut [Lanes]) {
        let (seen, given) = out.split_at_mut(self.features.width());
        self.features.forward(state, &self.features.hand(state), seen);
        self.write_action(action, given);
    }

    /// The last nine inputs.
    pub(super) fn write_action(&self, action: &[Lanes], given: &mut [Lanes]) {
        given.iter_mut().zip(action).enumerate().for_each(|(i, (slot, a))| *slot = a.map(|a| self.action.apply(i, a)));
    }

    /// What entry `i` of a state is known to become before learning; `action` is its joint's.
    #[inline]
    fn known_next(&self, i: usize, state: f32, action: f32) -> f32 {
        match self.structure {
            Structure::Kinematic if i < JOINTS => state + DT_S * action,
            Structure::Kinematic if i < 2 * JOINTS => action,
            _ => state,
        }
    }

    /// Gradient with respect to states, but for the network's part, from that with respect to the next states: in place, as every entry
    /// is known to stay, except that a kinematic structure does not look at dq.
    pub(super) fn known_backward(&self, d_state: &mut [Lanes]) {
        if self.structure == Structure::Kinematic {
            d_state[JOINTS..2 * JOINTS].fill(Lanes::default());
        }
    }

    /// The next states' changing entries from the network's output.
    pub(super) fn write_next(&self, state: &[Lanes], action: &[Lanes], output: &[Lanes], next: &mut [Lanes]) {
        for (i, slot) in next.iter_mut().enumerate() {
            let (state, action, output) = (state[i].0, action[i % JOINTS].0, output[i].0);
            *slot = Lanes(std::array::from_fn(|l| self.known_next(i, state[l], action[l]) + self.residual.undo(i, output[l])));
        }
    }

    /// What the network must put out for the observed next states, in their place.
    pub(super) fn write_residuals(&self, state: &[Lanes], action: &[Lanes], next: &mut [Lanes]) {
        for (i, slot) in next.iter_mut().enumerate() {
            let (state, action, next) = (state[i].0, action[i % JOINTS].0, slot.0);
            let residual = |l: usize| self.residual.apply(i, next[l] - self.known_next(i, state[l], action[l]));
            *slot = Lanes(std::array::from_fn(residual));
        }
    }

    /// Predicted next state row after `action` \[rad/s\] in `state_row`.
    ///
    /// # Panics
    /// When the row is not the task's.
    pub fn predict(&self, state_row: &[f32], action: &Action) -> Vec<f32> {
        assert_eq!(state_row.len(), self.task.state_dim(), "the row of another task than {}", self.task);
        let action = action.map(|v| Lanes::splat(v as f32));
        let mut state: Vec<Lanes> = state_row.iter().map(|v| Lanes::splat(*v)).collect();
        self.step(&mut state, &action, &mut Pass::new(&self.net, 1));
        state.iter().map(|entry| entry.0[0]).collect()
    }

    /// A panel of states becomes the next ones, by the mean of an ensemble; `pass` has room for one panel.
    pub(super) fn step(&self, state: &mut [Lanes], action: &[Lanes], pass: &mut Pass) {
        self.write_inputs(state, action, pass.input.panel_mut(0));
        let (mut output, mut next) = ([Lanes::default(); BASE_DIM], [Lanes::default(); BASE_DIM]);
        for net in [&self.net].into_iter().chain(&self.others) {
            net.forward(pass, 0..1);
            output.iter_mut().zip(pass.output.panel(0)).for_each(|(sum, value)| *sum += *value);
        }
        let members = (1 + self.others.len()) as f32;
        self.write_next(state, action, &output.map(|sum| sum / members), &mut next);
        state[..BASE_DIM].copy_from_slice(&next);
    }

    /// All arrays.
    pub fn to_tensors(&self) -> Vec<NamedTensor> {
        let mut out = Vec::new();
        push_features(&mut out, "dynamics", &self.features);
        push_scaling(&mut out, "dynamics.action", &self.action);
        push_scaling(&mut out, "dynamics.residual", &self.residual);
        push_network(&mut out, "dynamics", &self.net);
        self.others.iter().enumerate().for_each(|(i, net)| push_network(&mut out, &member(i), net));
        out
    }

    /// All that is not an array.
    pub fn meta(&self) -> Value {
        let (features, mask_dq) = self.features.choice();
        let widths = self.net.widths();
        json!({
            "network": "dynamics",
            "task": self.task,
            "state_dim": self.task.state_dim(),
            "features": features,
            "mask_dq": mask_dq,
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
        let task = reader.task("dynamics")?;
        let settings: PretrainSettings = reader.meta("settings")?;
        settings.validate().map_err(|why| format!("its settings cannot have trained it: {why}"))?;
        let features = reader.features("dynamics", task)?;
        let network = |name: &str| reader.network(name, features.width() + JOINTS, BASE_DIM);
        let (net, others) = (network("dynamics")?, (1..settings.ensemble).map(|i| network(&member(i - 1))));
        let others = others.collect::<Result<_, _>>()?;
        Ok(Dynamics {
            task,
            structure: reader.meta("structure")?,
            features,
            action: reader.scaling("dynamics.action", JOINTS)?,
            residual: reader.scaling("dynamics.residual", BASE_DIM)?,
            net,
            others,
            settings,
        })
    }
}

/// Name of the tensors of ensemble member `i` of [`Dynamics::others`].
fn member(i: usize) -> String {
    format!("dynamics.member_{}", i + 2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::samples::Samples;
    use crate::learn::testing::demos;
    use crate::seed::stream;

    #[test]
    fn dynamics_survive_their_tensors_and_copy_the_context() {
        let corpus = Corpus::new(demos(Task::Stack, 3, 20, 0), "training").expect("demos");
        for structure in [Structure::Plain, Structure::Kinematic] {
            let settings = PretrainSettings { structure, ensemble: 3, ..Default::default() };
            let mut dynamics = Dynamics::new(&corpus, &settings, &mut stream(0, "test", 0));
            (1..3).for_each(|i| dynamics.add_member(&mut stream(0, "test", i)));
            let back = Dynamics::from_tensors(&dynamics.to_tensors(), &dynamics.meta());
            assert_eq!(back.as_ref(), Ok(&dynamics));
            let next = dynamics.predict(corpus.state(4), &[0.1; JOINTS]);
            assert_eq!(next[BASE_DIM..], corpus.state(4)[BASE_DIM..]);
        }
    }

    #[test]
    fn a_description_out_of_its_limits_is_refused() {
        let corpus = Corpus::new(demos(Task::Stack, 3, 20, 0), "training").expect("demos");
        let dynamics = Dynamics::new(&corpus, &PretrainSettings::default(), &mut stream(0, "test", 0));
        for (key, value, said) in [
            ("hidden", json!([0]), "is [0]: networks have 1 to 16 hidden layers of 1 to 4096 units"),
            ("settings", json!({ "ensemble": u64::MAX }), "its settings cannot have trained it"),
            ("settings", json!({ "ensemble": 100 }), "dynamics.member_2.layer_1.weight is missing"),
        ] {
            let mut meta = dynamics.meta();
            meta[key] = value;
            let message = Dynamics::from_tensors(&dynamics.to_tensors(), &meta).expect_err(key);
            assert!(message.contains(said), "{key}: {message}");
        }
    }

    #[test]
    fn members_take_turns_and_predict_their_mean() {
        let corpus = Corpus::new(demos(Task::Stack, 3, 20, 0), "training").expect("demos");
        let mut dynamics = Dynamics::new(&corpus, &PretrainSettings::default(), &mut stream(0, "test", 0));
        let next = |dynamics: &Dynamics| f64::from(dynamics.predict(corpus.state(4), &[0.1; JOINTS])[BASE_DIM - 8]);
        let (first, alone) = (dynamics.net.clone(), next(&dynamics));
        dynamics.add_member(&mut stream(0, "test", 1));
        let second = Dynamics { others: Vec::new(), ..dynamics.clone() };
        assert!((next(&dynamics) - (alone + next(&second)) / 2.0).abs() < 1e-6);
        dynamics.turn();
        assert!(dynamics.net == first && dynamics.others == [second.net.clone()]);
        dynamics.turn();
        assert!(dynamics.net == second.net && dynamics.others == [first]);
    }

    #[test]
    fn the_target_undoes_the_prediction() {
        let corpus = Corpus::new(demos(Task::PickUp, 2, 20, 0), "training").expect("demos");
        let dynamics = Dynamics::new(&corpus, &PretrainSettings::default(), &mut stream(0, "test", 0));
        let (mut next, mut output) = ([Lanes::default(); BASE_DIM], [Lanes::default(); BASE_DIM]);
        corpus.model_samples(&dynamics).write_targets(&[7], &mut output);
        let splat = |row: &[f32]| -> Vec<Lanes> { row.iter().map(|v| Lanes::splat(*v)).collect() };
        dynamics.write_next(&splat(corpus.state(7)), &splat(corpus.executed(7)), &output, &mut next);
        for (a, b) in next.iter().zip(corpus.next(7)) {
            assert!((a.0[0] - b).abs() < 1e-6, "{a:?} against {b}");
        }
    }
}
