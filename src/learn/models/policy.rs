//! pi_theta: a Gaussian over joint velocity commands whose mean is a network of the state.

use super::corpus::Corpus;
use super::features::Features;
use super::older;
use super::scaling::Scaling;
use super::weights::{Reader, push_features, push_network, push_scaling, vector};
use crate::config::{MOST_HORIZON_STEPS, TrainSettings};
use crate::layout::Layout;
use crate::math::{exp_f32, ln};
use crate::nn::{Lanes, Mlp, Pass};
use crate::seed::normal;
use crate::tensor::NamedTensor;
use rand::Rng;
use serde_json::{Value, json};
use std::sync::Arc;

/// Spread of the demo actions below which they count as constant \[rad/s\].
const ACTION_FLOOR_RAD_S: f32 = 0.01;
/// The horizon of an episode over the 95th percentile of the demos' lengths.
const HORIZON_OVER_P95: usize = 2;

/// pi_theta with everything needed to run it.
///
/// ```
/// use hilt::data::weights::{POLICY, read};
/// use hilt::learn::Policy;
/// use hilt::tasks::with_layout;
///
/// let (tensors, description, made) = read("fixtures/pick-up/policy.safetensors".as_ref(), POLICY)?;
/// let policy = Policy::from_tensors(&tensors, &with_layout(description))?;
/// assert_eq!((made.task.as_str(), policy.layout().state_dim()), ("pick-up", 25));
/// let velocities = policy.act(&[0.1; 25]);
/// assert_eq!(velocities.len(), 9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Policy {
    horizon_steps: u32,
    features: Features,
    action: Scaling,
    pub(in crate::learn) net: Mlp,
    /// Log standard deviations, in units of the demo actions' own.
    pub(in crate::learn) log_std: Vec<f32>,
    settings: TrainSettings,
}

impl Policy {
    /// A policy with random weights; scalings and horizon from the training demos.
    pub fn new(corpus: &Corpus, settings: &TrainSettings, rng: &mut impl Rng) -> Self {
        let features = Features::fit(corpus, settings.features, settings.mask_dq);
        let dim = corpus.layout.action_dim();
        let action = Scaling::fit(
            corpus.rows(),
            dim,
            |i| corpus.layout.action_unit(i).map_or(0.0, |unit| ACTION_FLOOR_RAD_S * unit),
            |r, row| row.copy_from_slice(corpus.commanded(r)),
        );
        let mut lengths: Vec<usize> = (0..corpus.demos()).map(|i| corpus.demo(i).len()).collect();
        lengths.sort_unstable();
        let p95 = lengths[(lengths.len() * 95).div_ceil(100) - 1];
        // Demos of another program may be longer than any that is simulated.
        let horizon_steps = (HORIZON_OVER_P95 * p95).min(MOST_HORIZON_STEPS as usize) as u32;
        Self::with_scalings(features, action, horizon_steps, settings, rng)
    }

    /// The same, where scalings and horizon are known.
    pub(in crate::learn) fn with_scalings(
        features: Features,
        action: Scaling,
        horizon_steps: u32,
        settings: &TrainSettings,
        rng: &mut impl Rng,
    ) -> Self {
        let mut widths = vec![settings.hidden_units; settings.hidden_layers + 2];
        (widths[0], widths[settings.hidden_layers + 1]) = (features.width(), action.width());
        Policy {
            horizon_steps,
            log_std: vec![ln(settings.initial_std.max(settings.std_floor)) as f32; action.width()],
            features,
            action,
            net: Mlp::new(&widths, settings.activation, rng),
            settings: settings.clone(),
        }
    }

    /// Lets the network see by other scalings.
    pub(in crate::learn) fn set_features(&mut self, features: Features) {
        self.features = features;
    }

    /// What the rows that it was trained on hold.
    pub fn layout(&self) -> &Arc<Layout> {
        self.features.layout()
    }

    /// Control steps after which an episode is given up: twice the 95th percentile of the training demos' lengths.
    pub fn horizon_steps(&self) -> u32 {
        self.horizon_steps
    }

    /// The settings it was trained with.
    pub fn settings(&self) -> &TrainSettings {
        &self.settings
    }

    /// What it sees of a state.
    pub fn features(&self) -> &Features {
        &self.features
    }

    /// Statistics of the actions; the network's outputs are in their units.
    pub fn action_scaling(&self) -> &Scaling {
        &self.action
    }

    /// The network.
    pub fn network(&self) -> &Mlp {
        &self.net
    }

    /// Mean action in `state_row`, in the units of the layout.
    ///
    /// # Panics
    /// When the row is not the layout's.
    pub fn act(&self, state_row: &[f32]) -> Vec<f32> {
        self.mean(state_row).enumerate().map(|(i, mean)| self.action.undo(i, mean)).collect()
    }

    /// An action drawn from the Gaussian, in the units of the layout.
    ///
    /// # Panics
    /// When the row is not the layout's.
    pub fn sample(&self, state_row: &[f32], rng: &mut impl Rng) -> Vec<f32> {
        let noisy = |(i, mean)| self.action.undo(i, mean + exp_f32(self.log_std[i]) * normal(rng) as f32);
        self.mean(state_row).enumerate().map(noisy).collect()
    }

    fn mean(&self, state_row: &[f32]) -> impl Iterator<Item = f32> + use<> {
        let (dim, name) = (self.layout().state_dim(), &self.layout().name);
        assert_eq!(state_row.len(), dim, "the row of another task than {name}");
        let mut pass = Pass::new(&self.net, 1);
        let state: Vec<Lanes> = state_row.iter().map(|v| Lanes::splat(*v)).collect();
        self.features.forward(&state, &self.features.hand(&state), pass.input.panel_mut(0));
        self.net.forward(&mut pass, 0..1);
        (0..self.action.width()).map(move |i| pass.output.get(0, i))
    }

    /// All arrays.
    pub fn to_tensors(&self) -> Vec<NamedTensor> {
        let mut out = Vec::new();
        push_features(&mut out, "policy", &self.features);
        push_scaling(&mut out, "policy.action", &self.action);
        push_network(&mut out, "policy", &self.net);
        out.push(vector("policy.log_std", &self.log_std));
        out
    }

    /// All that is not an array.
    pub fn meta(&self) -> Value {
        let (features, mask_dq) = self.features.choice();
        let widths = self.net.widths();
        json!({
            "network": "policy",
            "task": self.layout().name,
            "state_dim": self.layout().state_dim(),
            "layout": **self.layout(),
            "features": features,
            "mask_dq": mask_dq,
            "inputs": self.features.names(),
            "activation": self.net.activation(),
            "hidden": &widths[1..widths.len() - 1],
            "horizon_steps": self.horizon_steps,
            "settings": self.settings,
        })
    }

    /// The inverse of [`Policy::to_tensors`] and [`Policy::meta`].
    ///
    /// # Errors
    /// Says what is missing or does not fit, with both numbers.
    pub fn from_tensors(tensors: &[NamedTensor], meta: &Value) -> Result<Self, String> {
        let reader = Reader { tensors, meta };
        let layout = reader.layout("policy")?;
        let horizon_steps: u32 = reader.meta("horizon_steps")?;
        if !(1..=MOST_HORIZON_STEPS).contains(&horizon_steps) {
            return Err(format!("\"horizon_steps\" of the description is {horizon_steps}; allowed: 1 to {MOST_HORIZON_STEPS}"));
        }
        let settings: TrainSettings = reader.settings(older::of_policy)?;
        settings.validate().map_err(|why| format!("its settings cannot have trained it: {why}"))?;
        let features = reader.features("policy", &layout)?;
        reader.inputs(&features.names())?;
        let net = reader.network("policy", features.width(), layout.action_dim())?;
        Ok(Policy {
            horizon_steps,
            features,
            action: reader.scaling("policy.action", layout.action_dim())?,
            net,
            log_std: reader.log_std("policy.log_std", layout.action_dim())?,
            settings,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::tests::testing::{Toy, demos};
    use crate::seed::stream;

    #[test]
    fn a_policy_survives_its_tensors_and_refuses_wrong_ones() {
        let corpus = Corpus::new(demos(Toy::Stack, 3, 20, 0), "training").expect("demos");
        let policy = Policy::new(&corpus, &TrainSettings::default(), &mut stream(0, "test", 0));
        assert_eq!(policy.horizon_steps(), 44);
        let (tensors, meta) = (policy.to_tensors(), policy.meta());
        assert_eq!(Policy::from_tensors(&tensors, &meta).as_ref(), Ok(&policy));

        let refused = |tensors: &[NamedTensor], meta: &Value| Policy::from_tensors(tensors, meta).expect_err("refused");
        let mut other = meta.clone();
        other["state_dim"] = json!(20);
        let message = refused(&tensors, &other);
        assert!(message.contains("20") && message.contains("28"), "{message}");
        let mut cut = tensors.clone();
        cut[4].shape = vec![8];
        assert!(refused(&cut, &meta).contains("[8]"), "{}", refused(&cut, &meta));
        assert!(refused(&tensors[1..], &meta).contains("policy.state.mean is missing"));
        other = meta.clone();
        other["network"] = json!("dynamics");
        assert!(refused(&tensors, &other).contains("dynamics"));
    }

    /// Regression: demos of another program that were longer than any here made a policy that nothing read.
    #[test]
    fn demos_of_any_length_make_a_policy_that_can_be_read() {
        let corpus = Corpus::new(demos(Toy::Stack, 1, MOST_HORIZON_STEPS as usize / 2 + 50, 0), "training").expect("demos");
        let policy = Policy::new(&corpus, &TrainSettings::default(), &mut stream(0, "test", 0));
        assert_eq!(policy.horizon_steps(), MOST_HORIZON_STEPS);
        assert_eq!(Policy::from_tensors(&policy.to_tensors(), &policy.meta()), Ok(policy));
    }

    #[test]
    fn a_description_out_of_its_limits_is_refused_before_anything_is_made_of_it() {
        let corpus = Corpus::new(demos(Toy::Stack, 3, 20, 0), "training").expect("demos");
        let policy = Policy::new(&corpus, &TrainSettings::default(), &mut stream(0, "test", 0));
        for (key, value, said) in [
            ("hidden", json!([0]), "is [0]: networks have 1 to 16 hidden layers of 1 to 4096 units"),
            ("hidden", json!([]), "is []: networks have"),
            ("hidden", json!(vec![8; 17]), "networks have 1 to 16"),
            ("hidden", json!([u64::MAX, u64::MAX]), "networks have 1 to 16"),
            ("horizon_steps", json!(0), "is 0; allowed: 1 to 20000"),
            ("horizon_steps", json!(4_294_967_295u32), "is 4294967295; allowed: 1 to 20000"),
            ("horizon_steps", json!("9".repeat(100_000)), "(100002 characters)"),
            ("inputs", json!(["a", "b"]), "\"inputs\" of the description names 2 inputs, but the network has 49"),
            ("settings", json!({ "tau": 0.0 }), "train.tau = 0"),
            ("settings", json!({ "hidden_units": 1e18 as u64 }), "train.hidden_units"),
        ] {
            let mut meta = policy.meta();
            meta[key] = value;
            let message = Policy::from_tensors(&policy.to_tensors(), &meta).expect_err(key);
            assert!(message.contains(said) && message.len() < 500, "{key}: {message}");
        }
        for (name, value, said) in [
            ("policy.state.std", 0.0, "above 0"),
            ("policy.log_std", f32::NAN, "NaN"),
            ("policy.log_std", 1e30, "allowed: -40 to 40"),
        ] {
            let mut tensors = policy.to_tensors();
            tensors.iter_mut().find(|t| t.name == name).expect("a tensor").data[0] = value;
            let message = Policy::from_tensors(&tensors, &policy.meta()).expect_err(name);
            assert!(message.contains(said), "{name}: {message}");
        }
    }

    #[test]
    fn inputs_in_another_order_are_refused_and_none_are_needed() {
        let corpus = Corpus::new(demos(Toy::Stack, 3, 20, 0), "training").expect("demos");
        let policy = Policy::new(&corpus, &TrainSettings::default(), &mut stream(0, "test", 0));
        let mut meta = policy.meta();
        meta["inputs"].as_array_mut().expect("names").swap(0, 3);
        let message = Policy::from_tensors(&policy.to_tensors(), &meta).expect_err("another order");
        assert!(message.contains("has \"q.3\" in place 0, where \"q.0\" is computed"), "{message}");
        meta.as_object_mut().expect("an object").remove("inputs");
        assert_eq!(Policy::from_tensors(&policy.to_tensors(), &meta).as_ref(), Ok(&policy));
    }

    #[test]
    fn a_policy_of_an_older_version_is_read() {
        let corpus = Corpus::new(demos(Toy::Stack, 3, 20, 0), "training").expect("demos");
        let mut settings = TrainSettings::default();
        (settings.sc.knee, settings.sc.balance) = (0.25, false);
        let policy = Policy::new(&corpus, &settings, &mut stream(0, "test", 0));
        let mut meta = policy.meta();
        let all = meta["settings"].as_object_mut().expect("a table");
        let sc = all.remove("sc").expect("a table of its own today");
        all.extend(sc.as_object().expect("a table").iter().map(|(key, value)| (format!("sc_{key}"), value.clone())));
        assert_eq!(Policy::from_tensors(&policy.to_tensors(), &meta).as_ref(), Ok(&policy));
        meta["settings"]["sc_kneee"] = json!(1);
        let message = Policy::from_tensors(&policy.to_tensors(), &meta).expect_err("a key that never was");
        assert!(message.contains("unknown field `kneee`"), "{message}");
    }

    #[test]
    fn samples_scatter_around_the_mean() {
        let corpus = Corpus::new(demos(Toy::PickUp, 2, 20, 0), "training").expect("demos");
        let policy = Policy::new(&corpus, &TrainSettings::default(), &mut stream(0, "test", 0));
        let (row, mut rng) = (corpus.state(3), stream(1, "test", 0));
        let mean = policy.act(row);
        let average: f32 = (0..2000).map(|_| policy.sample(row, &mut rng)[0]).sum::<f32>() / 2000.0;
        assert!((average - mean[0]).abs() < 0.1 * policy.action.std[0], "{average} against {}", mean[0]);
    }
}
