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
mod toy;

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
use rand::seq::SliceRandom;
use rayon::prelude::*;
use statistics::{Sight, Statistics};

/// The last layer of the policy starts this small: the first actions are noise around standing still.
const FIRST_ACTIONS: f32 = 0.01;

/// Stops a run from within an iteration, by returning an error.
pub type Check<'a> = &'a (dyn Fn() -> Result<()> + Sync);

/// Learning by proximal policy optimisation, between two iterations.
pub struct Ppo {
    settings: PpoSettings,
    std_floor: f64,
    seed: u64,
    sight: Sight,
    statistics: Statistics,
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
    /// Networks, and worlds at the beginning of their first episodes; `make` gives world 0, 1, ... of `train.ppo.worlds`.
    ///
    /// # Errors
    /// [`Error::Usage`] for settings out of range, [`Error::Failed`] when a world is of another task; what a first episode returns.
    pub fn new(task: Task, settings: &TrainSettings, seed: u64, make: impl Fn(usize) -> Result<Box<dyn Env>>) -> Result<Self> {
        settings.validate()?;
        let ppo = settings.ppo.clone();
        affordable(ppo.minibatch, settings.hidden_layers, settings.hidden_units, "train.ppo.minibatch or train.hidden_units")?;
        let sight = Sight { task, set: settings.features, mask_dq: settings.mask_dq };
        let unit = VELOCITY_LIMITS_RAD_S.map(|limit| (ppo.action_unit * limit) as f32);
        let action = Scaling { mean: vec![0.0; JOINTS], std: unit.to_vec() };
        let statistics = Statistics::new(sight);
        let mut rng = stream(seed, "train.ppo.init", 0);
        let mut policy = Policy::with_scalings(statistics.features(sight), action, ppo.horizon_steps, settings, &mut rng);
        policy.log_std.fill(ln(ppo.initial_std.max(settings.std_floor)) as f32);
        let (weights, biases) = policy.net.layer_ranges(policy.net.layers() - 1);
        policy.net.params_mut()[weights.start..biases.end].iter_mut().for_each(|w| *w *= FIRST_ACTIONS);
        let mut widths = policy.net.widths().to_vec();
        widths[settings.hidden_layers + 1] = 1;
        let value = Mlp::new(&widths, settings.activation, &mut rng);
        let mut learning = Ppo {
            records: (0..ppo.worlds / LANES).map(|_| Record::default()).collect(),
            groups: worlds_in_groups(task, &ppo, make)?,
            policy_adam: Adam::new(policy.net.params().len()),
            std_adam: Adam::new(JOINTS),
            value_adam: Adam::new(value.params().len()),
            std_floor: settings.std_floor,
            settings: ppo,
            seed,
            sight,
            statistics,
            policy,
            value,
            iteration: 0,
            updates: 0,
            work: Work::default(),
        };
        learning.see_first();
        Ok(learning)
    }

    /// Control steps of all worlds so far.
    pub fn steps(&self) -> u64 {
        self.iteration * self.settings.batch()
    }

    /// One iteration; what it has seen, in the order of `metrics::METRICS`.
    ///
    /// # Errors
    /// What `check` returns, [`Error::Failed`] when a number is none any more. The state is of no use then.
    pub fn iteration(&mut self, check: Check) -> Result<Row> {
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
            if !self.pass_over(epoch, rate, &mut tally)? {
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
        self.records.iter_mut().for_each(|record| record.sums = self.statistics.sums());
        let groups = self.groups.par_iter_mut().zip(&mut self.records).with_max_len(1);
        let acted: Vec<Result<()>> = groups.map(|(group, record)| group.act(&actors, check, record)).collect();
        acted.into_iter().collect()
    }

    /// Updates on all steps of the iteration, shuffled; whether there may be another pass.
    fn pass_over(&mut self, epoch: u64, rate: f64, tally: &mut Tally) -> Result<bool> {
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
            self.update(rate);
        }
        Ok(true)
    }

    fn update(&mut self, rate: f64) {
        let (work, limit) = (&mut self.work, self.settings.clip_norm);
        clip_by_global_norm(&mut work.d_policy, limit);
        clip_by_global_norm(&mut work.d_value, limit);
        self.policy_adam.step(&mut self.policy.net.params_mut(), &work.d_policy, rate);
        self.std_adam.step(&mut self.policy.log_std, &work.d_log_std, rate);
        gaussian::floor_log_std(&mut self.policy.log_std, ln(self.std_floor) as f32);
        self.value_adam.step(&mut self.value.params_mut(), &work.d_value, self.settings.value_learning_rate);
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
            record.sums = self.statistics.sums();
            group.first_sight(&self.policy, record);
        }
        self.take_in();
    }

    /// What the worlds have shown becomes the scalings of the policy's inputs.
    fn take_in(&mut self) {
        self.records.iter().for_each(|record| self.statistics.absorb(&record.sums));
        self.policy.set_features(self.statistics.features(self.sight));
    }
}

fn worlds_in_groups(task: Task, settings: &PpoSettings, make: impl Fn(usize) -> Result<Box<dyn Env>>) -> Result<Vec<Group>> {
    let count = settings.worlds as u64;
    let world = |place: usize| {
        let env = make(place)?;
        let (seen, asked) = (env.observation_len(), env.action_len());
        if (seen, asked) != (task.state_dim(), JOINTS) {
            return Err(Error::Failed(format!(
                "a world shows {seen} numbers and takes {asked}, but a policy of {task} sees {} and gives {JOINTS}",
                task.state_dim()
            )));
        }
        Episodes::new(env, place as u64, count)
    };
    let groups = (0..settings.worlds).step_by(LANES);
    groups.map(|first| Ok(Group::new((first..first + LANES).map(world).collect::<Result<_>>()?))).collect()
}
