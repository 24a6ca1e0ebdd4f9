//! Iterations as the epochs of a method.

use super::metrics::METRICS;
use super::{Lesson, Ppo};
use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::learn::models::{Dynamics, Policy, Reader};
use crate::learn::run::{EpochMetrics, Method, Metric, Saved, Stage};
use serde_json::Value;

/// The only stage.
const PPO: &str = "ppo";

impl Ppo {
    /// An iteration, reported as an epoch.
    ///
    /// # Errors
    /// As [`Ppo::iteration`]; [`crate::error::Error::Interrupted`].
    pub fn report(&mut self, stage: Stage, epoch: u64, interrupt: &Interrupt, lesson: &mut Lesson) -> Result<EpochMetrics> {
        let numbers = self.iteration(&|| interrupt.check(), lesson)?;
        let mut row = EpochMetrics::new(stage.name, epoch + 1, stage.epochs);
        METRICS.iter().zip(numbers).for_each(|(metric, value)| row.set(metric.name, value));
        row.updates = self.updates;
        Ok(row)
    }
}

impl Method for Ppo {
    fn stages(&self) -> Vec<Stage> {
        vec![Stage { name: PPO, epochs: self.settings.iterations() }]
    }

    fn metrics(&self) -> &'static [Metric] {
        &METRICS
    }

    fn begin(&mut self, _stage: &str) {}

    fn epoch(&mut self, stage: Stage, epoch: u64, interrupt: &Interrupt) -> Result<EpochMetrics> {
        self.report(stage, epoch, interrupt, &mut Lesson::Both(None))
    }

    fn end(&mut self, _stage: &str) {}

    fn candidate(&self) -> &Policy {
        &self.policy
    }

    fn save(&self) -> Saved {
        let (tensors, counts) = Ppo::save(self);
        Saved { tensors, counts }
    }

    fn restore(&mut self, counts: &Value, tensors: &Reader, past: &[EpochMetrics]) -> std::result::Result<(), String> {
        let last = past.last().ok_or("it holds no epoch")?;
        Ppo::restore(self, &Reader { tensors: tensors.tensors, meta: counts })?;
        if (self.iteration, self.updates) != (last.epoch, last.updates) {
            return Err(format!(
                "it counts {} iterations and {} updates, its {} {}",
                self.iteration,
                self.updates,
                last.place(),
                last.updates
            ));
        }
        Ok(())
    }

    fn remedy(&self, _tensor: &str) -> (&'static str, &'static str) {
        ("the policy or the value network", "lower train.ppo.learning_rate or train.ppo.value_learning_rate")
    }

    fn finish(self: Box<Self>) -> (Policy, Option<Dynamics>) {
        (self.policy, None)
    }
}
