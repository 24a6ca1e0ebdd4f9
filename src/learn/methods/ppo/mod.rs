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
mod episodes;
mod group;
mod method;
mod metrics;
mod objective;
mod state;
mod statistics;
#[cfg(test)]
mod tests;
#[cfg(test)]
pub(in crate::learn::methods) mod toy;

pub use metrics::METRICS;

use crate::config::{PpoSettings, TrainSettings};
use crate::env::Env;
use crate::error::{Error, Result};
use crate::learn::limits::affordable;
use crate::learn::models::{Policy, Scaling};
use crate::math::ln;
use crate::nn::{Adam, LANES, Mlp, clip_by_global_norm, cosine, gaussian};
use crate::robot::VELOCITY_LIMITS_RAD_S;
use crate::seed::stream;
use crate::state::JOINTS;
use crate::task::Task;
use advantage::{Credit, normalise};
use episodes::Episodes;
use group::{Actors, Group, Record};
use metrics::{Row, Tally};
use objective::{Choices, Seen, Work};
use rand::Rng;
use rand::seq::SliceRandom;
use rayon::prelude::*;
use statistics::{Sight, Statistics, Sums};

/// The last layer of the policy starts this small: the first actions are noise around standing still.
const FIRST_ACTIONS: f32 = 0.01;
/// The random stream of the weights.
const INIT: &str = "train.ppo.init";

/// Stops a run from within an iteration, by returning an error.
pub type Check<'a> = &'a (dyn Fn() -> Result<()> + Sync);

/// What an iteration is to improve.
pub enum Lesson<'a> {
    /// The value network alone.
    Value,
    /// Both networks. What is given adds a gradient of its own to that of the clipped objective for the policy's network.
    Both(Option<&'a mut dyn FnMut(&Policy, &mut [f32]) -> Result<()>>),
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
    /// Networks, and worlds at the beginning of their first episodes; `make` gives a world whose episodes are cut off after so many steps.
    ///
    /// # Errors
    /// [`Error::Usage`] for settings out of range, [`Error::Failed`] when a world is of another task; what a first episode returns.
    pub fn new(task: Task, settings: &TrainSettings, seed: u64, make: impl Fn(u32) -> Result<Box<dyn Env>>) -> Result<Self> {
        check_settings(settings)?;
        let ppo = &settings.ppo;
        let sight = Sight { task, set: settings.features, mask_dq: settings.mask_dq };
        let unit = VELOCITY_LIMITS_RAD_S.map(|limit| (ppo.action_unit * limit) as f32);
        let action = Scaling { mean: vec![0.0; JOINTS], std: unit.to_vec() };
        let statistics = Statistics::new(sight);
        let mut rng = stream(seed, INIT, 0);
        let mut policy = Policy::with_scalings(statistics.features(sight), action, ppo.horizon_steps, settings, &mut rng);
        policy.log_std.fill(ln(ppo.initial_std.max(settings.std_floor)) as f32);
        let (weights, biases) = policy.net.layer_ranges(policy.net.layers() - 1);
        policy.net.params_mut()[weights.start..biases.end].iter_mut().for_each(|w| *w *= FIRST_ACTIONS);
        let mut learning = Self::of(policy, settings, seed, &mut rng, make)?;
        learning.statistics = Some(statistics);
        learning.see_first();
        Ok(learning)
    }

    /// The same for a policy that learns elsewhere first: its horizon and the scalings of its inputs stay, and with them what it does.
    ///
    /// # Errors
    /// As [`Ppo::new`].
    pub fn going_on(
        policy: Policy,
        settings: &TrainSettings,
        seed: u64,
        make: impl Fn(u32) -> Result<Box<dyn Env>>,
    ) -> Result<Self> {
        check_settings(settings)?;
        Self::of(policy, settings, seed, &mut stream(seed, INIT, 0), make)
    }

    fn of(
        policy: Policy,
        settings: &TrainSettings,
        seed: u64,
        rng: &mut impl Rng,
        make: impl Fn(u32) -> Result<Box<dyn Env>>,
    ) -> Result<Self> {
        let ppo = settings.ppo.clone();
        let mut widths = policy.net.widths().to_vec();
        widths[settings.hidden_layers + 1] = 1;
        let value = Mlp::new(&widths, settings.activation, rng);
        Ok(Ppo {
            records: (0..ppo.worlds / LANES).map(|_| Record::default()).collect(),
            groups: worlds_in_groups(policy.task(), ppo.worlds, || make(policy.horizon_steps()))?,
            policy_adam: Adam::new(policy.net.params().len()),
            std_adam: Adam::new(JOINTS),
            value_adam: Adam::new(value.params().len()),
            std_floor: settings.std_floor,
            settings: ppo,
            seed,
            sight: Sight { task: policy.task(), set: settings.features, mask_dq: settings.mask_dq },
            statistics: None,
            policy,
            value,
            iteration: 0,
            updates: 0,
            work: Work::default(),
        })
    }

    /// Takes these weights, and this standard deviation of the actions in the policy's units.
    pub fn take_up(&mut self, weights: &Policy, std: f64) {
        self.policy.net.params_mut().copy_from_slice(weights.net.params());
        self.policy.log_std.fill(ln(std.max(self.std_floor)) as f32);
    }

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

    /// The first observations of all worlds are the first statistics.
    fn see_first(&mut self) {
        for (group, record) in self.groups.iter_mut().zip(&mut self.records) {
            record.sums = sums_for(&self.statistics);
            group.first_sight(&self.policy, record);
        }
        self.take_in();
    }

    /// What the worlds have shown becomes the scalings of the policy's inputs.
    fn take_in(&mut self) {
        let Some(statistics) = &mut self.statistics else { return };
        self.records.iter().for_each(|record| statistics.absorb(&record.sums));
        self.policy.set_features(statistics.features(self.sight));
    }
}

fn check_settings(settings: &TrainSettings) -> Result<()> {
    settings.validate()?;
    let keys = "train.ppo.minibatch or train.hidden_units";
    affordable(settings.ppo.minibatch, settings.hidden_layers, settings.hidden_units, keys)
}

/// What a record is to fill for the statistics, if there are any.
fn sums_for(statistics: &Option<Statistics>) -> Sums {
    statistics.as_ref().map(Statistics::sums).unwrap_or_default()
}

fn worlds_in_groups(task: Task, worlds: usize, make: impl Fn() -> Result<Box<dyn Env>>) -> Result<Vec<Group>> {
    let world = |place: usize| {
        let env = make()?;
        let (seen, asked) = (env.observation_len(), env.action_len());
        if (seen, asked) != (task.state_dim(), JOINTS) {
            return Err(Error::Failed(format!(
                "a world shows {seen} numbers and takes {asked}, but a policy of {task} sees {} and gives {JOINTS}",
                task.state_dim()
            )));
        }
        Episodes::new(env, place as u64, worlds as u64)
    };
    let groups = (0..worlds).step_by(LANES);
    groups.map(|first| Ok(Group::new((first..first + LANES).map(world).collect::<Result<_>>()?))).collect()
}
