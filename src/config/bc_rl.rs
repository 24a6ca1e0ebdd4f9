//! Settings of behavior cloning and reinforcement learning together.

use super::ppo::RewardKind;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[train.bc_rl]`: reinforcement learning that goes on with a policy of behavior cloning and keeps its loss (`hilt train --method bc-rl`).
/// The cloning before it is that of `--method bc` and has its keys in `[train]`; the rest is `[train.ppo]`, `total_steps` included. Of those
/// six are without effect: the policy's units and the horizon of an episode are those of the demos, not `action_unit`
/// and `horizon_steps`; `reward`, `initial_std`, `learning_rate` and `final_learning_rate` are here.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct BcRlSettings {
    /// What a step earns: the paper's milestones. The dense reward teaches more where cloning leaves much to learn, but where the task ends with
    /// letting go (stack) it pays for holding on, and takes from the policy what cloning had given it (docs/notes.md).
    pub reward: RewardKind,
    /// lambda_0: weight of L_BC (Eq. 3) beside the clipped objective when the policy begins to learn from rewards. Here L_BC is the mean square
    /// error of the mean action in units of the demo actions' own spread, whatever `train.loss` and `train.action` say. The 0.1 of
    /// Rajeswaran et al. weighs the likelihood: (9 / (2 std^2)) L_BC times the largest advantage, about 3 spreads, is 15 at a std of 0.3.
    pub lambda: f64,
    /// What the weight is multiplied by after each iteration (Rajeswaran et al. 2018: 0.95).
    pub lambda_decay: f64,
    /// Iterations in which only the value network learns: before it knows the policy's episodes, its advantages are noise.
    pub value_iterations: u64,
    /// Standard deviation of the actions when reinforcement learning begins, in units of the demo actions' own; `train.std_floor` is the
    /// smallest. How far a policy moves at the same divergence grows with it, and so does what the noise spoils.
    pub initial_std: f64,
    /// Adam's learning rate on the policy: the smaller the standard deviation, the farther the policy diverges by the same step.
    pub learning_rate: f64,
}

impl Default for BcRlSettings {
    fn default() -> Self {
        BcRlSettings {
            reward: RewardKind::Staged,
            lambda: 10.0,
            lambda_decay: 0.95,
            value_iterations: 5,
            initial_std: 0.3,
            learning_rate: 1e-4,
        }
    }
}
