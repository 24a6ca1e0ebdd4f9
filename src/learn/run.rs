//! A run of training between its epochs: metrics, model selection, checkpoints, and where to go on after one.

use super::checkpoint::{Checkpoint, History, State};
use super::hil::{Averages, Trained};
use super::learner::Learner;
use super::metrics::{EpochMetrics, table};
use super::policy::Policy;
use super::selection::Selection;
use crate::config::TrainSettings;
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use std::time::{Duration, Instant};

/// Counts the successes of a policy.
pub type Score<'a> = Box<dyn FnMut(&Policy) -> Result<u64> + 'a>;

/// What training asks of the world around it.
pub struct Hooks<'a> {
    /// Called after every epoch.
    pub log: Box<dyn FnMut(&EpochMetrics) + 'a>,
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
            log: Box::new(|_| {}),
            score: Box::new(move |_| Err(Error::Usage(no_rollouts.into()))),
            keep: Box::new(|_| {}),
            keep_every: None,
            resume: None,
            interrupt,
        }
    }
}

/// A learner on its way through the epochs. The last row of its metrics is the place that it has reached.
pub(super) struct Run<'a> {
    pub learner: Learner,
    settings: &'a TrainSettings,
    hooks: Hooks<'a>,
    history: History,
    /// The learner at the end of the last epoch, in which every number was one.
    good: Option<State>,
    /// Epochs in the checkpoint that was kept last, and when.
    kept: (usize, Instant),
}

impl<'a> Run<'a> {
    /// Begins, or goes on where the hooks say.
    ///
    /// # Errors
    /// [`Error::Failed`] for a checkpoint that does not fit the learner; what the first rollouts return.
    pub fn new(mut learner: Learner, settings: &'a TrainSettings, mut hooks: Hooks<'a>) -> Result<Self> {
        let mut history = History { rows: Vec::new(), selection: Selection::default(), best: None };
        let mut good = None;
        if let Some(checkpoint) = hooks.resume.take() {
            let restored = checkpoint.restore(&mut learner);
            let (state, past) = restored.map_err(|why| Error::Failed(format!("the checkpoint does not fit: {why}")))?;
            (history, good) = (past, Some(state));
        }
        let kept = (history.rows.len(), Instant::now());
        let mut run = Run { learner, settings, hooks, history, good, kept };
        run.select()?;
        Ok(run)
    }

    /// Whether the run has done an epoch of `stage` already.
    pub fn reached(&self, stage: &str) -> bool {
        self.history.rows.last().is_some_and(|row| row.stage == stage)
    }

    /// Enters `stage` and returns how many of its epochs are done; a stage that begins gets fresh optimisers.
    pub fn enter(&mut self, stage: &str) -> u64 {
        match self.history.rows.last() {
            Some(row) if row.stage == stage => row.epoch,
            _ => {
                self.learner.begin_stage();
                0
            }
        }
    }

    /// The averages of the mixing, as they were at the end of the last epoch.
    pub fn averages(&self) -> Averages {
        self.good.as_ref().map(State::averages).unwrap_or_default()
    }

    /// Stops on Ctrl-C.
    ///
    /// # Errors
    /// [`Error::Interrupted`].
    pub fn check(&self) -> Result<()> {
        self.hooks.interrupt.check()
    }

    /// Validates, logs, selects and keeps what the epoch has made.
    ///
    /// # Errors
    /// [`Error::Failed`] when no update of the epoch could be made or a number is none any more; what rollouts return.
    pub fn end_epoch(&mut self, metrics: EpochMetrics, averages: Averages) -> Result<()> {
        let row = self.learner.validate(metrics);
        self.check_validation(&row)?;
        self.refuse_standstill(&row)?;
        let state = self.learner.state(averages);
        state.check(&row)?;
        (self.hooks.log)(&row);
        self.history.rows.push(row);
        self.good = Some(state);
        self.select()?;
        if self.hooks.keep_every.is_some_and(|every| self.kept.1.elapsed() >= every) {
            self.keep();
        }
        Ok(())
    }

    /// An epoch may end just after its last update has gone wrong; the losses on the validation demos show it.
    fn check_validation(&self, row: &EpochMetrics) -> Result<()> {
        let policy = "lower train.learning_rate or train.warm_start_learning_rate, or set train.clip_norm";
        let l_bc = ("L_BC (Eq. 3)", row.validation_l_bc, policy);
        let model = ("the loss of the dynamics network (Eq. 6)", row.validation_l_model, "lower train.dynamics_learning_rate");
        let known = [Some(l_bc), self.learner.model.is_some().then_some(model)];
        match known.into_iter().flatten().find(|(_, value, _)| !value.is_finite()) {
            Some((term, value, remedy)) => {
                let (place, updates) = (row.place(), row.updates);
                Err(Error::Failed(format!(
                    "{term} on the validation demos is {value} after {place} (update {updates}): {remedy}"
                )))
            }
            None => Ok(()),
        }
    }

    /// An epoch in which every update was left out teaches nothing, nor will the next.
    fn refuse_standstill(&self, row: &EpochMetrics) -> Result<()> {
        let before = self.history.rows.last();
        let updates = row.updates - before.filter(|b| b.stage == row.stage).map_or(0, |b| b.updates);
        let skipped = row.skipped - before.map_or(0, |b| b.skipped);
        if skipped < updates || updates == 0 {
            return Ok(());
        }
        let (term, place, last) = (self.learner.left_out, row.place(), row.updates);
        Err(Error::Failed(format!(
            "the gradient of {term} was not finite in any of the {updates} updates of {place} (to update {last}): raise train.rho, \
             set train.clip_norm or lower train.learning_rate"
        )))
    }

    /// Rolls the averaged policy out when it is its turn. Interrupted here, a run that goes on begins with the same rollouts.
    fn select(&mut self) -> Result<()> {
        let Some(row) = self.history.rows.last() else { return Ok(()) };
        if self.history.selection.wants(row, self.settings) {
            let successes = (self.hooks.score)(&self.learner.averaged)?;
            if self.history.selection.offer(row, successes) {
                self.history.best = Some(self.learner.averaged.clone());
            }
        }
        Ok(())
    }

    fn keep(&mut self) {
        if let Some(state) = &self.good {
            (self.hooks.keep)(&Checkpoint::new(state, &self.history));
            self.kept = (self.history.rows.len(), Instant::now());
        }
    }

    /// Training ends early: the last good state is kept, unless it is already.
    pub fn keep_last(&mut self) {
        if self.kept.0 < self.history.rows.len() {
            self.keep();
        }
    }

    /// The results.
    pub fn finish(self) -> Trained {
        let (last, dynamics) = self.learner.finish();
        let History { rows, selection, best } = self.history;
        let policy = best.unwrap_or(last);
        Trained { policy, dynamics, metrics: table(&rows), selection: selection.best().is_some().then_some(selection) }
    }
}
