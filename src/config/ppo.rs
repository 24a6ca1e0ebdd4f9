//! Settings of proximal policy optimisation. Networks, features and the floor of the spread are those of `[train]`.

use super::limits::refuse;
use crate::error::{Error, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Worlds learn in lanes side by side, this many.
const LANES: usize = 8;
/// Steps of all worlds in one iteration: what is kept of them takes 300 bytes and more each.
const MOST_BATCH: usize = 1_000_000;

/// What a step of the simulator earns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RewardKind {
    /// The paper's milestones, each paid once an episode: nothing on the way to them.
    Staged,
    /// How far the task has come, in every step: see `tasks::dense_reward`.
    Dense,
}

/// `[train.ppo]`: proximal policy optimisation in the simulator (`hilt train --method ppo`), without demonstrations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PpoSettings {
    /// What a step earns.
    pub reward: RewardKind,
    /// Control steps in all worlds together; rounded up to whole iterations.
    pub total_steps: u64,
    /// Worlds side by side, a multiple of eight. They are dealt out to all cores.
    pub worlds: usize,
    /// Control steps of each world between two updates of the policy.
    pub steps: usize,
    /// Control steps before an episode is cut off, here and in an evaluation of the policy.
    pub horizon_steps: u32,
    /// gamma: what a reward is worth a step later.
    pub gamma: f64,
    /// lambda of generalised advantage estimation: 0 trusts the value network alone, 1 the rewards alone.
    pub gae_lambda: f64,
    /// How far the probability of an action may move from 1 times the old one before it earns no more.
    pub clip: f64,
    /// Passes over the steps of an iteration.
    pub epochs: u64,
    /// Steps per update; rounded up to a multiple of eight.
    pub minibatch: usize,
    /// Adam's learning rate at the first iteration.
    pub learning_rate: f64,
    /// Learning rate at the last iteration, reached along half a cosine; the same value keeps it constant.
    pub final_learning_rate: f64,
    /// Learning rate of the value network.
    pub value_learning_rate: f64,
    /// Weight of the policy's entropy in the objective.
    pub entropy: f64,
    /// Mean divergence from the old policy at which the passes of an iteration end; 0 = never.
    pub target_kl: f64,
    /// Largest norm of a network's gradient; 0 = no limit.
    pub clip_norm: f64,
    /// Unit of the networks' actions, as a share of each joint's velocity limit.
    pub action_unit: f64,
    /// Standard deviation of the actions at the start, in these units; `train.std_floor` is the smallest.
    pub initial_std: f64,
}

impl Default for PpoSettings {
    fn default() -> Self {
        PpoSettings {
            reward: RewardKind::Dense,
            total_steps: 4_000_000,
            worlds: 64,
            steps: 64,
            horizon_steps: 150,
            gamma: 0.95,
            gae_lambda: 0.9,
            clip: 0.2,
            epochs: 5,
            minibatch: 512,
            learning_rate: 3e-4,
            final_learning_rate: 3e-4,
            value_learning_rate: 1e-3,
            entropy: 0.0,
            target_kl: 0.05,
            clip_norm: 1.0,
            action_unit: 0.5,
            initial_std: 0.6,
        }
    }
}

impl PpoSettings {
    /// Steps of all worlds in one iteration.
    pub fn batch(&self) -> u64 {
        (self.worlds * self.steps) as u64
    }

    /// Iterations of the whole run.
    pub fn iterations(&self) -> u64 {
        self.total_steps.div_ceil(self.batch())
    }

    /// What the range of each number leaves open.
    ///
    /// # Errors
    /// [`Error::Usage`] names the keys and what is allowed.
    pub(super) fn validate(&self) -> Result<()> {
        if !self.worlds.is_multiple_of(LANES) {
            refuse("train.ppo.worlds", self.worlds, "a multiple of 8: worlds learn eight side by side")?;
        }
        if self.worlds.saturating_mul(self.steps) > MOST_BATCH {
            let (worlds, steps) = (self.worlds, self.steps);
            return Err(Error::Usage(format!(
                "train.ppo.worlds = {worlds} times train.ppo.steps = {steps} is more than an iteration holds: {MOST_BATCH} are the most"
            )));
        }
        Ok(())
    }
}
