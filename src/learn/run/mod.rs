//! The loop around any method of training: stages and epochs, metrics, model selection, checkpoints, and where to go on after one.

mod checkpoint;
mod exact;
mod history;
mod hooks;
mod method;
mod metrics;
pub(in crate::learn) mod past;
mod selection;

pub use checkpoint::Checkpoint;
pub use hooks::{Hooks, Score};
pub use method::{Method, Saved, Stage};
pub use metrics::{EpochMetrics, Mean, Metric, table};
pub use selection::{Candidate, Selection};

use crate::config::TrainSettings;
use crate::error::{Error, Result};
use crate::learn::models::{Dynamics, Policy};
use crate::table::Table;
use history::History;
use std::time::Instant;

/// What training leaves behind.
#[derive(Clone, Debug)]
pub struct Trained {
    /// pi_theta: the last, or the one that rollouts have chosen.
    pub policy: Policy,
    /// f_phi, fine-tuned if the settings say so.
    pub dynamics: Option<Dynamics>,
    /// One row an epoch.
    pub metrics: Table,
    /// How the policy was chosen, with `train.select_episodes` above 0.
    pub selection: Option<Selection>,
}

/// Runs a method through its stages. A run that goes on from a checkpoint of the same run ends with the same bits.
///
/// # Errors
/// [`Error::Failed`] for a checkpoint that does not fit; what the method and rollouts return.
pub fn run(method: Box<dyn Method + '_>, settings: &TrainSettings, hooks: Hooks) -> Result<Trained> {
    let mut run = Run::new(method, settings, hooks)?;
    match run.through_the_stages() {
        Ok(()) => Ok(run.finish()),
        Err(why) => {
            run.keep_last();
            Err(why)
        }
    }
}

/// A method on its way. The last row of the history is the place that it has reached.
struct Run<'a> {
    method: Box<dyn Method + 'a>,
    settings: &'a TrainSettings,
    hooks: Hooks<'a>,
    history: History,
    /// The method at the end of the last epoch, in which every number was one.
    good: Option<Saved>,
    /// Epochs in the checkpoint that was kept last, and when.
    kept: (usize, Instant),
}

impl<'a> Run<'a> {
    /// Begins, or goes on where the hooks say.
    fn new(mut method: Box<dyn Method + 'a>, settings: &'a TrainSettings, mut hooks: Hooks<'a>) -> Result<Self> {
        let (mut history, mut good) = (History::default(), None);
        if let Some(checkpoint) = hooks.resume.take() {
            let restored = checkpoint.restore(method.as_mut());
            history = restored.map_err(|why| Error::Failed(format!("the checkpoint does not fit: {why}")))?;
            good = Some(method.save());
        }
        let kept = (history.rows.len(), Instant::now());
        let mut run = Run { method, settings, hooks, history, good, kept };
        run.select()?;
        Ok(run)
    }

    fn through_the_stages(&mut self) -> Result<()> {
        let stages = self.method.stages();
        let reached = self.history.rows.last().map(|row| (row.stage.clone(), row.epoch));
        let (mut done, mut at) = (0, 0);
        if let Some((name, epoch)) = reached {
            (done, at) = (epoch, stages.iter().position(|stage| stage.name == name).unwrap_or(0));
        }
        for stage in &stages[at..] {
            if done == 0 {
                self.method.begin(stage.name);
            }
            for epoch in done..stage.epochs {
                let row = self.method.epoch(*stage, epoch, self.hooks.interrupt)?;
                self.end_epoch(row)?;
            }
            self.method.end(stage.name);
            done = 0;
        }
        Ok(())
    }

    /// Logs, selects and keeps what the epoch has made.
    fn end_epoch(&mut self, row: EpochMetrics) -> Result<()> {
        let saved = self.method.save();
        if let Some(bad) = saved.tensors.iter().find(|t| t.data.iter().any(|v| !v.is_finite())) {
            let (what, remedy) = self.method.remedy(&bad.name);
            return Err(Error::Failed(format!("{what} is no longer finite after {}: {remedy}", row.place())));
        }
        (self.hooks.log)(&row, self.method.metrics());
        self.history.rows.push(row);
        self.good = Some(saved);
        self.select()?;
        if self.hooks.keep_every.is_some_and(|every| self.kept.1.elapsed() >= every) {
            self.keep();
        }
        Ok(())
    }

    /// Rolls the policy out when it is its turn. Interrupted here, a run that goes on begins with the same rollouts.
    fn select(&mut self) -> Result<()> {
        let Some(row) = self.history.rows.last() else { return Ok(()) };
        if self.history.selection.wants(row, self.settings) {
            let successes = (self.hooks.score)(self.method.candidate())?;
            if self.history.selection.offer(row, successes) {
                self.history.best = Some(self.method.candidate().clone());
            }
        }
        Ok(())
    }

    fn keep(&mut self) {
        if let Some(saved) = &self.good {
            (self.hooks.keep)(&Checkpoint::new(saved, &self.history));
            self.kept = (self.history.rows.len(), Instant::now());
        }
    }

    /// Training ends early: the last good state is kept, unless it is already.
    fn keep_last(&mut self) {
        if self.kept.0 < self.history.rows.len() {
            self.keep();
        }
    }

    fn finish(self) -> Trained {
        let metrics = table(&self.history.rows, self.method.metrics());
        let (last, dynamics) = self.method.finish();
        let History { selection, best, .. } = self.history;
        let selection = selection.best().is_some().then_some(selection);
        Trained { policy: best.unwrap_or(last), dynamics, metrics, selection }
    }
}
