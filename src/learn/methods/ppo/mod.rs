//! Proximal policy optimisation (Schulman et al. 2017): a policy learns from the rewards of many worlds, without a demonstration.
//!
//! One iteration: all worlds act for `train.ppo.steps` steps, generalised advantage estimation judges them, and a few passes over the
//! steps improve policy and value network on the clipped objective until the policy has moved by `train.ppo.target_kl`.
//!
//! The policy is that of the other methods ([`Policy`]), so that everything that runs one runs this one. Its inputs are standardised by
//! the statistics of all steps so far; they become its scalings between two iterations, so that the policy that acts, the one that
//! learns and the one that is saved see the same.
//!
//! Nothing depends on the number of threads: a world has its own random streams, eight worlds make a panel and act by themselves,
//! and sums are taken in one order. A world comes back by its actions since the last reset ([`Ppo::restore`]).

mod advantage;
mod beginning;
mod episodes;
mod group;
mod metrics;
mod objective;
mod stages;
mod state;
mod statistics;
#[cfg(test)]
mod tests;
#[cfg(test)]
pub(in crate::learn::methods) mod toy;

pub use metrics::METRICS;

use crate::config::PpoSettings;
use crate::error::{Error, Result};
use crate::learn::models::Policy;
use crate::math::ln;
use crate::nn::{Adam, LANES, Mlp, clip_by_global_norm, cosine, gaussian};
use crate::seed::stream;
use advantage::{Credit, normalise};
use group::{Actors, Group, Record};
use metrics::{Row, Tally};
use objective::{Choices, Seen, Work};
use rand::seq::SliceRandom;
use rayon::prelude::*;
use statistics::{Sight, Statistics, Sums};

/// Stops a run from within an iteration, by returning an error.
pub type Check<'a> = &'a (dyn Fn() -> Result<()> + Sync);

/// Adds a gradient of its own to one of the policy's network.
pub type Further<'a> = &'a mut dyn FnMut(&Policy, &mut [f32]) -> Result<()>;

/// What an iteration is to improve.
pub enum Lesson<'a> {
    /// The value network alone.
    Value,
    /// Both networks, the policy also by what is given beside the clipped objective.
    Both(Option<Further<'a>>),
}

/// Learning by proximal policy optimisation, between two iterations.
pub struct Ppo {
    settings: PpoSettings,
    std_floor: f64,
    seed: u64,
    sight: Sight,
    /// What the policy's inputs are scaled by; `None` = its scalings stay.
    statistics: Option<Statistics>,
    policy: Policy,
    value: Mlp,
    policy_adam: Adam,
    std_adam: Adam,
    value_adam: Adam,
    groups: Vec<Group>,
    /// What each group has brought in the last iteration.
    records: Vec<Record>,
    iteration: u64,
    /// Updates so far.
    updates: u64,
    work: Work,
}

impl Ppo {
    /// Control steps of all worlds so far.
    pub fn steps(&self) -> u64 {
        self.iteration * self.settings.batch()
    }

    /// One iteration; what it has seen, in the order of `metrics::METRICS`.
    ///
    /// # Errors
    /// What `check` and the lesson return, [`Error::Failed`] when a number is none any more. The state is of no use then.
    pub fn iteration(&mut self, check: Check, lesson: &mut Lesson) -> Result<Row> {
        self.act(check)?;
        normalise(self.records.iter_mut().map(|record| &mut record.advantages));
        let mut tally = Tally::new(&self.records);
        let rate = cosine(
            self.settings.learning_rate,
            self.settings.final_learning_rate,
            self.iteration,
            self.settings.iterations().saturating_sub(1),
        );
        for epoch in 0..self.settings.epochs {
            check()?;
            if !self.pass_over(epoch, rate, lesson, &mut tally)? {
                break;
            }
        }
        self.iteration += 1;
        self.take_in();
        self.updates += tally.updates();
        Ok(tally.row(self.steps(), rate, &self.policy.log_std))
    }

    fn act(&mut self, check: Check) -> Result<()> {
        let actors = Actors {
            policy: &self.policy,
            value: &self.value,
            credit: Credit { gamma: self.settings.gamma as f32, lambda: self.settings.gae_lambda as f32 },
            seed: self.seed,
            iteration: self.iteration,
            steps: self.settings.steps,
        };
        self.records.iter_mut().for_each(|record| record.sums = sums_for(&self.statistics));
        let groups = self.groups.par_iter_mut().zip(&mut self.records).with_max_len(1);
        let acted: Vec<Result<()>> = groups.map(|(group, record)| group.act(&actors, check, record)).collect();
        acted.into_iter().collect()
    }

    /// Updates on all steps of the iteration, shuffled; whether there may be another pass.
    fn pass_over(&mut self, epoch: u64, rate: f64, lesson: &mut Lesson, tally: &mut Tally) -> Result<bool> {
        let mut panels: Vec<(usize, usize)> =
            (0..self.groups.len()).flat_map(|g| (0..self.settings.steps).map(move |t| (g, t))).collect();
        let pass = self.iteration * self.settings.epochs + epoch;
        panels.shuffle(&mut stream(self.seed, "train.ppo.order", pass));
        let choices = Choices { clip: self.settings.clip as f32, entropy: self.settings.entropy as f32 };
        for part in panels.chunks(self.settings.minibatch.div_ceil(LANES)) {
            let seen = self.work.look(&self.policy, &self.value, &self.records, part, choices);
            self.check_numbers(&seen)?;
            tally.see(&seen);
            if self.settings.target_kl > 0.0 && seen.kl > self.settings.target_kl {
                return Ok(false);
            }
            self.update(rate, lesson)?;
        }
        Ok(true)
    }

    fn update(&mut self, rate: f64, lesson: &mut Lesson) -> Result<()> {
        let (work, limit) = (&mut self.work, self.settings.clip_norm);
        clip_by_global_norm(&mut work.d_value, limit);
        self.value_adam.step(&mut self.value.params_mut(), &work.d_value, self.settings.value_learning_rate);
        let Lesson::Both(further) = lesson else { return Ok(()) };
        if let Some(further) = further {
            further(&self.policy, &mut work.d_policy)?;
        }
        clip_by_global_norm(&mut work.d_policy, limit);
        self.policy_adam.step(&mut self.policy.net.params_mut(), &work.d_policy, rate);
        self.std_adam.step(&mut self.policy.log_std, &work.d_log_std, rate);
        gaussian::floor_log_std(&mut self.policy.log_std, ln(self.std_floor) as f32);
        Ok(())
    }

    fn check_numbers(&self, seen: &Seen) -> Result<()> {
        let all = |numbers: &[f32]| numbers.iter().all(|v| v.is_finite());
        let work = &self.work;
        let policy = seen.policy_loss.is_finite() && all(&work.d_policy) && all(&work.d_log_std);
        let value = seen.value_loss.is_finite() && all(&work.d_value);
        let (what, remedy) = match (policy, value) {
            (true, true) => return Ok(()),
            (false, _) => ("the clipped objective", "train.ppo.learning_rate"),
            (true, false) => ("the loss of the value network", "train.ppo.value_learning_rate"),
        };
        let iteration = self.iteration + 1;
        Err(Error::Failed(format!("{what} or its gradient is no finite number in iteration {iteration}: lower {remedy}")))
    }

    /// What the worlds have shown becomes the scalings of the policy's inputs.
    fn take_in(&mut self) {
        let Some(statistics) = &mut self.statistics else { return };
        self.records.iter().for_each(|record| statistics.absorb(&record.sums));
        self.policy.set_features(statistics.features(&self.sight));
    }
}

/// What a record is to fill for the statistics, if there are any.
fn sums_for(statistics: &Option<Statistics>) -> Sums {
    statistics.as_ref().map(Statistics::sums).unwrap_or_default()
}
