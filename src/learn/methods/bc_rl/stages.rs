//! The epochs of behavior cloning, then iterations, as the epochs of one method. What it saves is the state of the part that learns.

use super::{BC_RL, BcRl};
use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::learn::methods::{hil, ppo};
use crate::learn::models::{Dynamics, Policy, Reader};
use crate::learn::run::{EpochMetrics, Method, Metric, Saved, Stage};
use serde_json::Value;
use std::sync::LazyLock;

/// The numbers of both parts, and what is new.
static METRICS: LazyLock<Vec<Metric>> = LazyLock::new(|| {
    let lambda = Metric::shown("lambda", "lambda", "Weight of L_BC beside the clipped objective");
    let cloning = hil::METRICS.iter().filter(|of_both| ppo::METRICS.iter().all(|metric| metric.name != of_both.name));
    [lambda].iter().chain(cloning).chain(&ppo::METRICS).copied().collect()
});

impl BcRl {
    fn part(&self) -> &dyn Method {
        if self.by_rewards { &self.ppo } else { &self.cloning }
    }

    fn part_mut(&mut self) -> &mut dyn Method {
        if self.by_rewards { &mut self.ppo } else { &mut self.cloning }
    }
}

impl Method for BcRl {
    fn stages(&self) -> Vec<Stage> {
        let iterations = self.ppo.stages().into_iter().map(|stage| Stage { name: BC_RL, ..stage });
        self.cloning.stages().into_iter().chain(iterations).collect()
    }

    fn metrics(&self) -> &'static [Metric] {
        &METRICS
    }

    fn begin(&mut self, stage: &str) {
        self.by_rewards = stage == BC_RL;
        if self.by_rewards {
            self.ppo.take_up(self.cloning.policy(), self.settings.initial_std);
        }
        self.part_mut().begin(stage);
    }

    fn epoch(&mut self, stage: Stage, epoch: u64, interrupt: &Interrupt) -> Result<EpochMetrics> {
        if self.by_rewards { self.iteration(stage, epoch, interrupt) } else { self.cloning.epoch(stage, epoch, interrupt) }
    }

    fn end(&mut self, stage: &str) {
        self.part_mut().end(stage);
    }

    fn candidate(&self) -> &Policy {
        self.part().candidate()
    }

    fn save(&self) -> Saved {
        Method::save(self.part())
    }

    fn restore(&mut self, counts: &Value, tensors: &Reader, past: &[EpochMetrics]) -> std::result::Result<(), String> {
        self.by_rewards = past.last().is_some_and(|row| row.stage == BC_RL);
        self.part_mut().restore(counts, tensors, past)
    }

    fn remedy(&self, tensor: &str) -> (&'static str, &'static str) {
        let (what, remedy) = self.part().remedy(tensor);
        (what, if self.by_rewards { "lower train.bc_rl.learning_rate or train.ppo.value_learning_rate" } else { remedy })
    }

    fn finish(self: Box<Self>) -> (Policy, Option<Dynamics>) {
        Box::new(self.ppo).finish()
    }
}
