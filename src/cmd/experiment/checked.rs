//! An experiment before its first step.

use super::args::Args;
use crate::experiment::state::State;
use crate::experiment::{Experiment, Grid};
use std::path::PathBuf;

/// An experiment whose file and directory have been checked.
pub struct Checked<'a> {
    pub args: &'a Args,
    pub experiment: Experiment,
    pub dir: PathBuf,
    pub grid: Grid,
    pub jobs: usize,
    /// Threads of a step.
    pub threads: usize,
}

impl Checked<'_> {
    /// Runs that are not finished.
    pub fn unfinished(&self, states: &[State]) -> usize {
        self.grid.runs.iter().filter(|run| states[run.evaluate] != State::Done).count()
    }
}
