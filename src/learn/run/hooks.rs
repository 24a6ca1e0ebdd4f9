//! What training asks of the world around it.

use super::checkpoint::Checkpoint;
use super::metrics::{EpochMetrics, Metric};
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use crate::learn::models::Policy;
use std::time::Duration;

/// Counts the successes of a policy.
pub type Score<'a> = Box<dyn FnMut(&Policy) -> Result<u64> + 'a>;

/// Takes in an epoch, whose numbers are the method's.
pub type Log<'a> = Box<dyn FnMut(&EpochMetrics, &'static [Metric]) + 'a>;

/// What training asks of the world around it.
pub struct Hooks<'a> {
    /// Called after every epoch.
    pub log: Log<'a>,
    /// Rolls a policy out on `train.select_episodes` episodes and counts the successes; called only when that is above 0.
    pub score: Score<'a>,
    /// Takes a checkpoint: when the time has come, and the last good one when training ends early.
    pub keep: Box<dyn FnMut(&Checkpoint) + 'a>,
    /// Time between two checkpoints; `None` = only when training ends early.
    pub keep_every: Option<Duration>,
    /// Where to go on.
    pub resume: Option<Checkpoint>,
    /// Ctrl-C.
    pub interrupt: &'a Interrupt,
}

impl<'a> Hooks<'a> {
    /// Training that nobody watches, from the beginning.
    pub fn new(interrupt: &'a Interrupt) -> Self {
        let no_rollouts = "model selection needs rollouts, but there is no simulator here; set train.select_episodes = 0";
        Hooks {
            log: Box::new(|_, _| {}),
            score: Box::new(move |_| Err(Error::Usage(no_rollouts.into()))),
            keep: Box::new(|_| {}),
            keep_every: None,
            resume: None,
            interrupt,
        }
    }
}
