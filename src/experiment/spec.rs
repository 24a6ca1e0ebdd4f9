//! What an experiment is.

use super::report_kind::ReportKind;
use crate::config::Stage;
use crate::learn::MethodName;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Settings of `train` by the method that they are for.
pub type MethodSets = BTreeMap<MethodName, Vec<String>>;

/// What an experiment's file says, with names in place of words.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// The file's name without its ending: the name of the directory of its runs.
    pub name: String,
    /// The file.
    pub path: PathBuf,
    /// What it is for.
    pub description: String,
    /// What there is to say of its results: plain paragraphs, `code` in backticks.
    pub notes: String,
    /// What a report shows of it.
    pub report: ReportKind,
    /// The variation that a report compares the others with.
    pub reference: Option<String>,
    /// Names of its tasks.
    pub tasks: Vec<String>,
    /// As its file says them: the same names, or files.
    pub said: Vec<String>,
    /// Presets: those that come with hilt, or directories below `pipelines` with a file a task.
    pub presets: Vec<String>,
    /// Methods.
    pub methods: Vec<MethodName>,
    /// Seeds.
    pub seeds: Vec<u64>,
    /// Episodes of each evaluation, if not those of the preset.
    pub episodes: Option<u64>,
    /// Settings of all runs, over those of the preset.
    pub set: Vec<String>,
    /// Settings of the training of single methods, over those.
    pub method_set: MethodSets,
    /// Datasets to learn from instead of own demos; `{task}` and `{seed}` stand for those of a run.
    pub dataset: Option<String>,
    /// Whether evaluations are recorded, as `rollouts/`.
    pub record: bool,
    /// Variations; none = the plain settings.
    pub variations: Vec<Variation>,
}

/// What the command line says instead of the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overrides {
    /// Seeds.
    pub seeds: Option<Vec<u64>>,
    /// Episodes of each evaluation.
    pub episodes: Option<u64>,
}

/// A named change of settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Variation {
    /// Its name, a directory's.
    pub name: String,
    /// The earlier variation whose settings it begins with.
    pub extends: Option<String>,
    /// Settings, over those of the experiment.
    pub set: Vec<String>,
    /// Settings of the training of single methods, over all others.
    pub method_set: MethodSets,
    /// Stages that they hold for.
    pub stages: Vec<Stage>,
    /// Names of the tasks that have it.
    pub tasks: Vec<String>,
    /// Methods that have it.
    pub methods: Vec<MethodName>,
}
