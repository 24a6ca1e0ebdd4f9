//! Settings: one struct per stage, doc, default and unit beside each field; frozen after parsing.
//! Precedence: defaults < preset or pipeline file < `hilt.toml` < `--set stage.key=value` < flags.

mod bc_rl;
mod check;
mod choices;
mod data;
mod explain;
mod learning;
mod limits;
mod load;
mod pipeline_file;
mod ppo;
mod preset;
mod pretrain;
mod project;
mod randomise;
mod ranges;
mod robot;
mod sc;
mod scene;
mod task;
mod train;

pub use bc_rl::BcRlSettings;
pub use choices::{
    ActionChoice, Alpha, Convergence, FeatureSet, FingerCloning, ModelLoss, Objective, Pairs, StateScale, Structure, Updates,
};
pub use data::{ConvertSettings, EvaluateSettings};
pub use explain::{Explained, OfPreset, explain};
pub use learning::LearningSettings;
pub use load::Source;
pub use ppo::{PpoSettings, RewardKind};
pub use preset::Preset;
pub use pretrain::PretrainSettings;
pub use project::ProjectFile;
pub use randomise::RandomiseSettings;
pub use ranges::{MOST_HORIZON_STEPS, MOST_LAYERS, MOST_STEPS, MOST_UNITS};
pub use robot::{ChosenRobot, is_file};
pub use sc::ScSettings;
pub use scene::{FingerPulses, PlanSettings, PulseSettings, SceneSettings, SimulateSettings, check_scene};
pub use task::ChosenTask;
pub use train::TrainSettings;

use crate::error::{Error, Result};
use crate::task::Task;
use crate::words::unknown;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::str::FromStr;
use std::sync::Arc;

/// Every setting of every stage for one task: what a pipeline file holds.
///
/// ```
/// use hilt::config::{ChosenTask, Pipeline, Preset, Source};
///
/// let source = Source::BuiltIn(ChosenTask::read("stack")?, Preset::Best);
/// let pipeline = Pipeline::load(&source, &["train.rho=0.5".into()])?;
/// assert_eq!((pipeline.task.name.as_str(), pipeline.train.rho), ("stack", 0.5));
/// assert!(Pipeline::load(&source, &["train.roh=0.5".into()]).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pipeline {
    /// The task: the name of one that comes with hilt, the TOML file of another, or `[task]` itself.
    #[schemars(with = "String")]
    pub task: ChosenTask,
    /// Who does it: `jaco`, `panda`, `ur5e`, or the TOML file of a robot, relative to the pipeline file.
    #[serde(default)]
    #[schemars(with = "String")]
    pub robot: ChosenRobot,
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

/// A stage that writes an artefact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Demonstrations as joint trajectories.
    Plan,
    /// Their execution in contact physics.
    Simulate,
    /// Recordings to datasets.
    Convert,
    /// The dynamics network.
    Pretrain,
    /// The policy.
    Train,
    /// Rollouts of a policy.
    Evaluate,
}

impl Stage {
    /// All stages, in the order of the pipeline.
    pub const ALL: [Stage; 6] = [Stage::Plan, Stage::Simulate, Stage::Convert, Stage::Pretrain, Stage::Train, Stage::Evaluate];

    /// The subcommand's name.
    pub fn name(self) -> &'static str {
        ["plan", "simulate", "convert", "pretrain", "train", "evaluate"][self as usize]
    }

    /// The sections of a pipeline file, and the robot, that can change what this stage writes, given its input files.
    pub fn sections(self) -> &'static [&'static str] {
        match self {
            Stage::Plan => &["robot", "scene", "plan"],
            Stage::Simulate => &["robot", "simulate"],
            Stage::Convert => &["robot", "convert"],
            Stage::Pretrain => &["robot", "scene", "simulate", "pretrain"],
            Stage::Train => &["robot", "scene", "simulate", "train"],
            Stage::Evaluate => &["robot", "scene", "plan", "simulate", "evaluate"],
        }
    }
}

impl FromStr for Stage {
    type Err = String;

    fn from_str(s: &str) -> std::result::Result<Self, String> {
        Stage::ALL.into_iter().find(|stage| stage.name() == s).ok_or_else(|| unknown("stage", s, &Stage::ALL.map(Stage::name)))
    }
}

impl Pipeline {
    /// Every setting of `task` at its default.
    pub fn defaults(task: &Arc<Task>) -> Self {
        Pipeline {
            task: Arc::clone(task).into(),
            robot: ChosenRobot::default(),
            scene: SceneSettings::default(),
            plan: PlanSettings::default(),
            simulate: SimulateSettings::default(),
            convert: ConvertSettings::default(),
            pretrain: PretrainSettings::default(),
            train: TrainSettings::default(),
            evaluate: EvaluateSettings::default(),
        }
    }

    /// The resolved settings as a TOML document: all of them, or those that `stage` reads (the paper's robot unsaid: it is there where none is named).
    ///
    /// # Errors
    /// [`Error::Failed`] when a value has no form in TOML.
    pub fn to_toml(&self, stage: Option<Stage>) -> Result<String> {
        let mut table = self.to_table()?;
        if stage.is_some() && self.robot.is_default() {
            table.remove("robot");
        }
        table.retain(|key, _| key == "task" || stage.is_none_or(|stage| stage.sections().contains(&key)));
        toml::to_string(&table).map_err(|e| Error::Failed(format!("settings cannot be written as TOML: {e}")))
    }

    /// The settings that `stage` reads, as they go into the provenance of what it writes; the robot by what it is, not by what its files are called, and the
    /// paper's not at all, as in files from when there was no other; so the task.
    ///
    /// # Errors
    /// [`Error::Failed`] when a value has no form in JSON.
    pub fn to_json(&self, stage: Stage) -> Result<serde_json::Value> {
        let mut table = self.to_table()?;
        table.retain(|key, _| stage.sections().contains(&key));
        table.remove("robot");
        let mut say = |key: &str, [name, content]: [String; 2]| {
            let said = [("name", name), ("content", content)].map(|(key, value)| (key.into(), value.into()));
            table.insert(key.into(), toml::Table::from_iter(said).into());
        };
        if !self.robot.is_default() {
            say("robot", [self.robot.name.clone(), self.robot.content()]);
        }
        if !self.task.is_of_the_paper() {
            say("task", [self.task.name.clone(), self.task.content()]);
        }
        serde_json::to_value(table).map_err(|e| Error::Failed(format!("settings cannot be written as JSON: {e}")))
    }

    fn to_table(&self) -> Result<toml::Table> {
        toml::Table::try_from(self).map_err(|e| Error::Failed(format!("settings cannot be written as TOML: {e}")))
    }
}
