//! Settings of the dataset and of the evaluation.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[convert]`: recordings to datasets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ConvertSettings {
    /// Training episodes per validation episode (paper 4.2: 10:1; 200 episodes split 182/18).
    pub train_per_validation: u32,
    /// Whether failed episodes stay in the dataset.
    pub keep_failed: bool,
    /// The most demos to take, the first that succeeded; 0 = all. Plan some more than this when pulses make some fail.
    pub demos: u64,
}

impl Default for ConvertSettings {
    fn default() -> Self {
        ConvertSettings { train_per_validation: 10, keep_failed: false, demos: 0 }
    }
}

/// `[evaluate]`: seeded rollouts on episodes that no demo used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct EvaluateSettings {
    /// Episodes.
    pub episodes: u64,
    /// Control steps before an episode is given up; 0 = twice the 95th percentile of the demos' lengths.
    pub horizon_steps: u32,
    /// Whether actions are sampled from the policy's Gaussian instead of its mean.
    pub stochastic: bool,
    /// Whether the pulses of `[simulate.pulses]` disturb evaluation episodes too; the noise always does.
    pub pulses: bool,
}

impl Default for EvaluateSettings {
    fn default() -> Self {
        EvaluateSettings { episodes: 500, horizon_steps: 0, stochastic: false, pulses: false }
    }
}
