//! HIL as a method: its stages, what it saves, and what it refuses.

use super::metrics::METRICS;
use super::{HIL, Hil, MODEL_REMEDY, WARM_START, per_epoch};
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use crate::learn::methods::batches::Batches;
use crate::learn::methods::mixing::Averages;
use crate::learn::methods::validation::validate;
use crate::learn::methods::{descent, fine_tuning};
use crate::learn::models::{Dynamics, Policy, Reader};
use crate::learn::run::past::{MOST_UPDATES, at_most};
use crate::learn::run::{EpochMetrics, Method, Metric, Saved, Stage};
use crate::seed::stream;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// What of [`Hil`] is no array.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Counts {
    draws: u64,
    descent: descent::Counts,
    /// Steps of the dynamics network's optimiser.
    model: Option<u32>,
    averages: Averages,
}

impl Method for Hil {
    fn stages(&self) -> Vec<Stage> {
        let updates = self.settings.warm_start(self.inputs.train.rows());
        let of_warm_start = Batches::new(&self.inputs.train, self.settings.bc_batch).per_epoch();
        let epochs = self.settings.epochs_of(per_epoch(&self.inputs.train, &self.settings));
        vec![Stage { name: WARM_START, epochs: updates.div_ceil(of_warm_start) }, Stage { name: HIL, epochs }]
    }

    fn metrics(&self) -> &'static [Metric] {
        &METRICS
    }

    fn begin(&mut self, stage: &str) {
        self.descent.begin_stage();
        if stage == HIL {
            self.mixing.averages = Averages::default();
        }
    }

    fn epoch(&mut self, stage: Stage, epoch: u64, interrupt: &Interrupt) -> Result<EpochMetrics> {
        let before = (self.descent.updates, self.descent.skipped);
        let mut row = match stage.name {
            WARM_START => self.warm_start(stage, epoch, interrupt)?,
            _ => self.hybrid_imitation_learning(stage, epoch, interrupt)?,
        };
        row.updates = self.descent.updates;
        row.set("skipped_updates", self.descent.skipped as f64);
        self.descent.update_averaged();
        let mut rng = stream(self.seed, "train.validate", self.draws);
        validate(
            &self.descent.averaged,
            &self.inputs.validation,
            &self.work.bc_choices,
            self.model.as_mut(),
            &mut rng,
            &mut row,
        )?;
        self.refuse_standstill(&row, before)?;
        Ok(row)
    }

    fn end(&mut self, _stage: &str) {
        self.descent.end_stage();
    }

    fn candidate(&self) -> &Policy {
        &self.descent.averaged
    }

    fn save(&self) -> Saved {
        let mut tensors = Vec::new();
        let descent = self.descent.save(&mut tensors);
        let model = self.model.as_ref().map(|model| model.save(&mut tensors));
        let counts = Counts { draws: self.draws, descent, model, averages: self.mixing.averages };
        Saved { tensors, counts: json!(counts) }
    }

    fn restore(&mut self, counts: &Value, tensors: &Reader, past: &[EpochMetrics]) -> std::result::Result<(), String> {
        let counts = Counts::deserialize(counts).map_err(|why| format!("its counts: {why}"))?;
        at_most("draws", counts.draws, MOST_UPDATES)?;
        counts.averages.check()?;
        let skipped = |row: &EpochMetrics| row.get("skipped_updates") as u64;
        if !past.is_sorted_by_key(skipped) {
            return Err("the updates that it left out become fewer from one epoch to the next".into());
        }
        let last = past.last().ok_or("it holds no epoch")?;
        self.descent.restore(tensors, &counts.descent, (last.updates, skipped(last)))?;
        if let Some(model) = &mut self.model {
            model.restore(tensors, counts.model.ok_or("it was made without a dynamics network")?)?;
        }
        (self.draws, self.mixing.averages) = (counts.draws, counts.averages);
        Ok(())
    }

    fn remedy(&self, tensor: &str) -> (&'static str, &'static str) {
        if tensor.starts_with(fine_tuning::NET) {
            ("the dynamics network (Eq. 6)", MODEL_REMEDY)
        } else {
            ("the policy (L_mix, Eq. 1)", POLICY_REMEDY)
        }
    }

    fn finish(self: Box<Self>) -> (Policy, Option<Dynamics>) {
        (self.descent.policy, self.model.map(|model| model.dynamics))
    }
}

const POLICY_REMEDY: &str = "lower train.learning_rate or train.warm_start_learning_rate, or set train.clip_norm";

impl Hil {
    /// An epoch in which every update was left out teaches nothing, nor will the next.
    fn refuse_standstill(&self, row: &EpochMetrics, (updates, skipped): (u64, u64)) -> Result<()> {
        let (made, left_out) = (self.descent.updates - updates, self.descent.skipped - skipped);
        if left_out < made || made == 0 {
            return Ok(());
        }
        let (term, place, last) = (self.descent.left_out, row.place(), row.updates);
        Err(Error::Failed(format!(
            "the gradient of {term} was not finite in any of the {made} updates of {place} (to update {last}): raise train.rho, set \
             train.clip_norm or lower train.learning_rate"
        )))
    }
}
