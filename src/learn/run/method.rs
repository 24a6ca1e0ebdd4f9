//! What a method of training is to the loop around it.

use super::metrics::{EpochMetrics, Metric};
use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::learn::models::{Dynamics, Policy, Reader};
use crate::tensor::NamedTensor;
use serde_json::Value;

/// A part of training that has epochs of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stage {
    /// Its name in metrics and checkpoints.
    pub name: &'static str,
    /// Its epochs, 0 to leave it out.
    pub epochs: u64,
}

/// All of a method that changes from update to update.
#[derive(Clone, Debug)]
pub struct Saved {
    /// Arrays of f32.
    pub tensors: Vec<NamedTensor>,
    /// What f32 cannot hold.
    pub counts: Value,
}

/// A way to teach a policy. The loop ([`super::run()`]) goes through its stages, logs, selects, keeps, and goes on after a checkpoint.
pub trait Method {
    /// The stages in their order, each with another name.
    fn stages(&self) -> Vec<Stage>;

    /// The numbers that it reports for each epoch.
    fn metrics(&self) -> &'static [Metric];

    /// Before a stage's first epoch.
    fn begin(&mut self, stage: &str);

    /// Epoch `epoch` of a stage, from 0.
    ///
    /// # Errors
    /// [`crate::error::Error::Failed`] when a number is none any more, in words that say what to change;
    /// [`crate::error::Error::Interrupted`].
    fn epoch(&mut self, stage: Stage, epoch: u64, interrupt: &Interrupt) -> Result<EpochMetrics>;

    /// After a stage's last epoch.
    fn end(&mut self, stage: &str);

    /// The policy as it would be kept now.
    fn candidate(&self) -> &Policy;

    /// Its state between two epochs.
    fn save(&self) -> Saved;

    /// Takes up the state after the last of the epochs `past` (at least one) of a run with the same inputs, settings and seed.
    ///
    /// # Errors
    /// Says what is missing, does not fit or cannot be.
    fn restore(&mut self, counts: &Value, tensors: &Reader, past: &[EpochMetrics]) -> std::result::Result<(), String>;

    /// What a saved tensor belongs to, and what to change when it is no longer finite.
    fn remedy(&self, tensor: &str) -> (&'static str, &'static str);

    /// The results: the last policy, and the dynamics network if there is one.
    fn finish(self: Box<Self>) -> (Policy, Option<Dynamics>);
}
