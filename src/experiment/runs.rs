//! The runs of an experiment and the steps that they share.

use super::step::Step;
use crate::learn::MethodName;

/// One policy and its evaluation: a row of the results.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// The task's name.
    pub task: String,
    /// The preset.
    pub preset: String,
    /// The variation; empty = the plain settings.
    pub variation: String,
    /// The method.
    pub method: MethodName,
    /// The seed.
    pub seed: u64,
    /// The step that trains, by its place among the steps.
    pub train: usize,
    /// The step that evaluates.
    pub evaluate: usize,
}

/// All of an experiment.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Its commands, each after those that it needs; seed by seed, so that a first comparison is there early.
    pub steps: Vec<Step>,
    /// Its runs, in the order of the file: task, preset, variation, method, seed.
    pub runs: Vec<Run>,
}
