//! Settings: one struct per stage, doc, default and unit beside each field; frozen after parsing.
//! Precedence: defaults < pipeline file < `--set stage.key=value` < flags.

mod choices;
mod data;
mod learn;
mod scene;

pub use choices::{ActionChoice, Alpha, Convergence, FeatureSet, ModelLoss, Objective, Pairs, StateScale, Structure};
pub use data::{ConvertSettings, EvaluateSettings};
pub use learn::{PretrainSettings, TrainSettings};
pub use scene::{PlanSettings, PulseSettings, SceneSettings, SimulateSettings};

use crate::tasks::Task;
use serde::{Deserialize, Serialize};

/// Every setting of every stage for one task: what a pipeline file holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pipeline {
    /// The task.
    pub task: Task,
    /// Where things stand.
    #[serde(default)]
    pub scene: SceneSettings,
    /// `hilt plan`.
    #[serde(default)]
    pub plan: PlanSettings,
    /// `hilt simulate`.
    #[serde(default)]
    pub simulate: SimulateSettings,
    /// `hilt convert`.
    #[serde(default)]
    pub convert: ConvertSettings,
    /// `hilt pretrain`.
    #[serde(default)]
    pub pretrain: PretrainSettings,
    /// `hilt train`.
    #[serde(default)]
    pub train: TrainSettings,
    /// `hilt evaluate`.
    #[serde(default)]
    pub evaluate: EvaluateSettings,
}
