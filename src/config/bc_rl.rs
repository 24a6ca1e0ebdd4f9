//! Settings of behavior cloning and reinforcement learning together.

use serde::{Deserialize, Serialize};

/// `[train.bc_rl]`: reinforcement learning that goes on with a policy of behavior cloning and keeps its loss (`hilt train --method bc-rl`).
/// The cloning before it is that of `--method bc` and has its keys in `[train]`; the rest is `[train.ppo]`, `total_steps` and `reward`
/// included. Three keys are without effect: the policy's units and the horizon of an episode are those of the demos, not
/// `train.ppo.action_unit` and `train.ppo.horizon_steps`, and the spread begins at `train.bc_rl.initial_std`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BcRlSettings {
    /// lambda_0: weight of L_BC (Eq. 3) beside the clipped objective when the policy begins to learn from rewards.
    pub lambda: f64,
    /// What the weight is multiplied by after each iteration (Rajeswaran et al. 2018: 0.95).
    pub lambda_decay: f64,
    /// Iterations in which only the value network learns: before it knows the policy's episodes, its advantages are noise.
    pub value_iterations: u64,
    /// Standard deviation of the actions when reinforcement learning begins, in units of the demo actions' own; `train.std_floor` is the
    /// smallest.
    pub initial_std: f64,
}

impl Default for BcRlSettings {
    fn default() -> Self {
        BcRlSettings { lambda: 0.1, lambda_decay: 0.95, value_iterations: 5, initial_std: 0.1 }
    }
}
