//! Settings of the policy. Defaults are the preset `best`; the literal preset of the paper sets the keys that differ.

use super::bc_rl::BcRlSettings;
use super::choices::{ActionChoice, Alpha, Convergence, FeatureSet, Objective, Updates};
use super::limits::{network, within_ranges};
use super::ppo::PpoSettings;
use super::randomise::RandomiseSettings;
use super::sc::ScSettings;
use crate::error::{Error, Result};
use crate::nn::Activation;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[train]`: the policy, Algorithms 1-3.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TrainSettings {
    /// Activation of the hidden layers (paper: tanh in Figure 3, rectifier in 4.2).
    pub activation: Activation,
    /// Hidden layers (paper: 3).
    pub hidden_layers: usize,
    /// Units of a hidden layer (paper: 100).
    pub hidden_units: usize,
    /// What the policy sees of the state.
    pub features: FeatureSet,
    /// Whether joint velocities are hidden from the policy. They tell the last action, which a policy may learn to copy; but with few
    /// demos they are worth more than anything else.
    pub mask_dq: bool,
    /// Units and normalisation of L_BC and L_SC.
    pub loss: Objective,
    /// Which a_t the losses see: the mean, or a reparameterised sample.
    pub action: ActionChoice,
    /// Standard deviation of the Gaussian at the start, in units of the demo actions' own.
    pub initial_std: f64,
    /// Smallest standard deviation, in the same units.
    pub std_floor: f64,
    /// What d_conv (Eq. 4) measures.
    pub d_conv: Convergence,
    /// tau: error of the mean action, in standard deviations of the demo actions, at which p_t falls to exp(-1/2).
    pub tau: f64,
    /// alpha of Eq. 1: `"adaptive"` (= d_conv) or a number in \[0, 1\].
    #[schemars(with = "String")]
    pub alpha: Alpha,
    /// Upper bound of an adaptive alpha; 1 = none.
    pub alpha_max: f64,
    /// Whether an adaptive alpha is averaged over about an epoch instead of following each update.
    pub alpha_average: bool,
    /// rho: state recovery probability of Algorithm 3.
    pub rho: f64,
    /// What the policy sees of the demos.
    pub randomise: RandomiseSettings,
    /// L_SC.
    pub sc: ScSettings,
    /// Whether the dynamics network keeps learning from observed transitions (Eq. 6) during training.
    pub fine_tune_dynamics: bool,
    /// Learning rate of that.
    pub dynamics_learning_rate: f64,
    /// Updates of plain behavior cloning before Algorithm 1 begins; 0 = from scratch, `"auto"` = 380 passes over the demos, but no fewer than 15,000
    /// updates and no more than 100,000. State cloning alone (`sc`) leaves them out.
    #[schemars(with = "String")]
    pub warm_start_updates: Updates,
    /// State-action pairs per update of the warm start, shuffled across demos.
    pub bc_batch: usize,
    /// Learning rate at the beginning of the warm start; it ends at `final_learning_rate`.
    pub warm_start_learning_rate: f64,
    /// Epochs E of Algorithm 1; 0 = only the warm start.
    pub epochs: u64,
    /// Fewest updates of Algorithm 1: with few demos an epoch is short, and there are more epochs. Without effect when `epochs` is 0.
    pub min_updates: u64,
    /// Demos per update of Algorithm 1 (paper: 1).
    pub batch: usize,
    /// Adam's learning rate at the first update of Algorithm 1 (paper: 1e-3).
    pub learning_rate: f64,
    /// Learning rate at the last update, reached along half a cosine; the same value keeps it constant.
    pub final_learning_rate: f64,
    /// Largest norm of the policy's gradient; 0 = no limit.
    pub clip_norm: f64,
    /// Decay of the average of the weights that is validated and kept; 0 = the last weights.
    pub ema_decay: f64,
    /// Episodes that choose among the policies along the way, none of which an evaluation uses; 0 = keep the last policy.
    pub select_episodes: u64,
    /// Candidates of the warm start and of Algorithm 1, each: evenly spaced, the last at the end.
    pub select_candidates: u64,
    /// Reinforcement learning (`hilt train --method ppo`).
    pub ppo: PpoSettings,
    /// Behavior cloning and reinforcement learning together (`hilt train --method bc-rl`).
    pub bc_rl: BcRlSettings,
}

impl Default for TrainSettings {
    fn default() -> Self {
        TrainSettings {
            activation: Activation::Tanh,
            hidden_layers: 3,
            hidden_units: 100,
            features: FeatureSet::FkNear,
            mask_dq: false,
            loss: Objective::StandardisedMean,
            action: ActionChoice::Mean,
            initial_std: 0.5,
            std_floor: 0.02,
            d_conv: Convergence::Agreement,
            tau: 0.5,
            alpha: Alpha::Adaptive,
            alpha_max: 0.8,
            alpha_average: true,
            rho: 0.3,
            randomise: RandomiseSettings::default(),
            sc: ScSettings::default(),
            fine_tune_dynamics: true,
            dynamics_learning_rate: 1e-4,
            warm_start_updates: Updates::Auto,
            bc_batch: 512,
            warm_start_learning_rate: 1e-3,
            epochs: 60,
            min_updates: 2000,
            batch: 8,
            learning_rate: 3e-4,
            final_learning_rate: 1e-5,
            clip_norm: 1.0,
            ema_decay: 0.999,
            select_episodes: 0,
            select_candidates: 3,
            ppo: PpoSettings::default(),
            bc_rl: BcRlSettings::default(),
        }
    }
}

/// Passes of an automatic warm start over the demos. With 300 demos of tower by the Panda, twice as long as those of stack, 15,000 updates are 127 passes, and
/// leave a hand before the block whose fingers close half; 250 and 380 solve 190 and 198 of 200, of sort 172 and 192 (docs/notes.md).
const PASSES: u64 = 380;
/// Its fewest updates: what the paper's three tasks were found to need, with few demos too.
const LEAST_UPDATES: u64 = 15_000;
/// Its most updates: a few minutes. LeRobot's own default is as long.
pub(super) const MOST_AUTO_UPDATES: u64 = 100_000;

impl TrainSettings {
    /// Updates of the warm start on so many transitions.
    pub fn warm_start(&self, transitions: usize) -> u64 {
        match self.warm_start_updates {
            Updates::Exactly(updates) => updates,
            Updates::Auto => (PASSES * self.updates_of_a_pass(transitions)).clamp(LEAST_UPDATES, MOST_AUTO_UPDATES),
        }
    }

    /// Updates of behavior cloning in which every transition comes once.
    pub(super) fn updates_of_a_pass(&self, transitions: usize) -> u64 {
        transitions.div_ceil(self.bc_batch.max(1)) as u64
    }

    /// Epochs of Algorithm 1 when one has `per_epoch` updates.
    pub fn epochs_of(&self, per_epoch: u64) -> u64 {
        if self.epochs == 0 { 0 } else { self.epochs.max(self.min_updates.div_ceil(per_epoch.max(1))) }
    }

    /// Checks every key.
    ///
    /// # Errors
    /// [`Error::Usage`] names the key, its value and what is allowed.
    pub fn validate(&self) -> Result<()> {
        within_ranges("train", self)?;
        network("train", self.hidden_layers, self.hidden_units)?;
        self.ppo.validate()?;
        if self.epochs == 0 && self.warm_start_updates == Updates::Exactly(0) {
            return Err(Error::Usage("train.epochs and train.warm_start_updates are both 0: there is nothing to do".into()));
        }
        Ok(())
    }
}
