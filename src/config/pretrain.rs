//! Settings of the dynamics network. Defaults are the preset `best`.

use super::choices::{FeatureSet, ModelLoss, Structure};
use super::limits::{network, within_ranges};
use super::scene::{FingerPulses, PulseSettings};
use crate::error::Result;
use crate::nn::Activation;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[pretrain]`: the dynamics network, Algorithm 4.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PretrainSettings {
    /// Activation of the hidden layers (paper: tanh in Figure 3, rectifier in 4.2).
    pub activation: Activation,
    /// Hidden layers (paper: 3).
    pub hidden_layers: usize,
    /// Units of a hidden layer (paper: 100).
    pub hidden_units: usize,
    /// What the network sees of the state; the action always comes with it.
    pub features: FeatureSet,
    /// What is known before learning: nothing, or that joints integrate their command.
    pub structure: Structure,
    /// The loss of Eq. 6.
    pub loss: ModelLoss,
    /// K: how often each demo's commands are executed again in the simulator, under new noise and the pulses below (Algorithm 4 executes
    /// them). The dynamics network learns from them; the policy never sees them.
    pub reexecute: u64,
    /// Disturbance pulses of those executions.
    pub reexecute_pulses: PulseSettings,
    /// Commands of the fingers in those executions.
    pub reexecute_fingers: FingerPulses,
    /// Epochs E over the demos; the learning rate falls along all of them, but they may end before, as `patience` says.
    pub epochs: u64,
    /// Epochs after which a network is done when they have not brought its loss on the validation demos `min_gain` below the lowest that
    /// came before them; 0 = all epochs.
    pub patience: u64,
    /// That gain, as a share of the loss.
    pub min_gain: f64,
    /// Transitions per update, shuffled across demos; 0 = one whole demo per update, as Algorithm 4 has it.
    pub batch_rows: usize,
    /// Adam's learning rate at the first update (paper: 1e-3).
    pub learning_rate: f64,
    /// Learning rate at the last update, reached along half a cosine; the same value keeps it constant.
    pub final_learning_rate: f64,
    /// Largest norm of the gradient; 0 = no limit.
    pub clip_norm: f64,
    /// Decay of the average of the weights that is kept as the result; 0 = the last weights.
    pub ema_decay: f64,
}

impl Default for PretrainSettings {
    fn default() -> Self {
        PretrainSettings {
            activation: Activation::Tanh,
            hidden_layers: 3,
            hidden_units: 100,
            features: FeatureSet::Fk,
            structure: Structure::Kinematic,
            loss: ModelLoss::StandardisedHuber,
            reexecute: 0,
            reexecute_pulses: PulseSettings { probability: 0.01, ..PulseSettings::default() },
            reexecute_fingers: FingerPulses::default(),
            epochs: 200,
            patience: 10,
            min_gain: 0.02,
            batch_rows: 512,
            learning_rate: 1e-3,
            final_learning_rate: 1e-5,
            clip_norm: 1.0,
            ema_decay: 0.999,
        }
    }
}

impl PretrainSettings {
    /// Checks every key.
    ///
    /// # Errors
    /// [`crate::error::Error::Usage`] names the key, its value and what is allowed.
    pub fn validate(&self) -> Result<()> {
        within_ranges("pretrain", self)?;
        network("pretrain", self.hidden_layers, self.hidden_units)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_out_of_range_are_refused_by_name() {
        let message = |settings: PretrainSettings| settings.validate().expect_err("refused").to_string();
        let base = PretrainSettings::default;
        assert!(base().validate().is_ok());
        let cases = [
            (PretrainSettings { epochs: 0, ..base() }, "pretrain.epochs = 0 is not allowed; it must be from 1 to"),
            (
                PretrainSettings { reexecute: 1001, ..base() },
                "pretrain.reexecute = 1001 is not allowed; it must be from 0 to 1000",
            ),
        ];
        for (settings, expected) in cases {
            let said = message(settings);
            assert!(said.contains(expected), "{said}");
        }
    }
}
