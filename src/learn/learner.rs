//! The state of training between updates: networks, optimisers, workspaces, and the single steps that Algorithm 1 is made of.

use super::behavior_cloning::{self as bc, Cloned, draw_noise, policy_gradient};
use super::corpus::Corpus;
use super::dynamics::Dynamics;
use super::fine_tuning::Model;
use super::limits::{affordable, before_the_first_update};
use super::metrics::{EpochMetrics, action_errors};
use super::policy::Policy;
use super::pushes::Pushes;
use super::shards::add_scaled;
use super::state_cloning::{self as sc, Segment, draw_segments};
use crate::config::{ActionChoice, TrainSettings};
use crate::demo::Demo;
use crate::error::{Error, Result};
use crate::math::ln;
use crate::nn::{Adam, Ema, clip_by_global_norm, gaussian, global_norm};
use crate::seed::stream;
use crate::state::JOINTS;
use std::borrow::Cow;

/// A parameter vector's way down.
pub(super) struct Descent {
    pub adam: Adam,
    pub ema: Ema,
}

/// Norm of a gradient above which Adam's second moment, a square, would not fit into an f32.
const LARGEST_NORM: f64 = 1e19;

impl Descent {
    fn new(params: &[f32], ema_decay: f64) -> Self {
        Descent { adam: Adam::new(params.len()), ema: Ema::new(params, ema_decay) }
    }
}

/// A policy under training. One update of Algorithm 1 is [`Learner::behavior_cloning`], [`Learner::state_cloning`],
/// [`Learner::update`] and [`Learner::fine_tune`] on the same demos.
pub struct Learner {
    pub(super) seed: u64,
    pub(super) corpus: Corpus,
    /// Updates of the present stage.
    pub(super) updates: u64,
    pub(super) skipped: u64,
    /// The loss whose gradient made the last update be left out.
    pub(super) left_out: &'static str,
    pub(super) settings: TrainSettings,
    pub(super) policy: Policy,
    pub(super) averaged: Policy,
    held_out: Corpus,
    pub(super) model: Option<Model>,
    pub(super) net_descent: Descent,
    pub(super) std_descent: Descent,
    bc_choices: bc::Choices,
    sc_choices: sc::Choices,
    bc_work: bc::Workspace,
    sc_work: sc::Workspace,
    validation_work: bc::Workspace,
    segments: Vec<Segment>,
    sc_noise: Vec<f32>,
    pushes: Pushes,
    gradient: Vec<f32>,
    /// Counts updates of all stages: the number of the random streams.
    pub(super) draws: u64,
}

impl Learner {
    /// Networks, statistics and inputs for these demos.
    ///
    /// # Errors
    /// [`Error::Failed`] without demos or when tasks differ.
    pub fn new<'a>(
        train: impl Into<Cow<'a, [Demo]>>,
        validation: impl Into<Cow<'a, [Demo]>>,
        dynamics: Option<Dynamics>,
        settings: &TrainSettings,
        seed: u64,
    ) -> Result<Self> {
        let (corpus, held_out) = (Corpus::new(train, "training")?, Corpus::new(validation, "validation")?);
        let tasks = [Some(held_out.task), dynamics.as_ref().map(Dynamics::task)];
        if let Some(other) = tasks.into_iter().flatten().find(|t| *t != corpus.task) {
            return Err(Error::Failed(format!(
                "the training demos are of {} (states of {} numbers), but validation demos or dynamics network of {other} ({})",
                corpus.task,
                corpus.task.state_dim(),
                other.state_dim()
            )));
        }
        let most_rows = settings.bc_batch.max(settings.batch * corpus.longest()).min(corpus.rows());
        affordable(
            most_rows,
            settings.hidden_layers,
            settings.hidden_units,
            "train.batch, train.bc_batch or train.hidden_units",
        )?;
        let policy = Policy::new(&corpus, settings, &mut stream(seed, "train.init", 0));
        let model = dynamics.map(Model::new);
        Ok(Learner {
            seed,
            updates: 0,
            skipped: 0,
            left_out: "",
            model,
            net_descent: Descent::new(policy.net.params(), settings.ema_decay),
            std_descent: Descent::new(&policy.log_std, settings.ema_decay),
            bc_choices: bc::Choices::new(settings),
            sc_choices: sc::Choices::new(settings, &corpus),
            bc_work: bc::Workspace::new(&policy, most_rows),
            sc_work: sc::Workspace::default(),
            validation_work: bc::Workspace::default(),
            segments: Vec::with_capacity(most_rows),
            sc_noise: Vec::with_capacity(most_rows * JOINTS),
            pushes: Pushes::new(settings, most_rows),
            gradient: vec![0.0; policy.net.params().len()],
            draws: 0,
            settings: settings.clone(),
            averaged: policy.clone(),
            policy,
            corpus,
            held_out,
        })
    }

    /// Mean number of actions of a training demo.
    pub fn mean_length(&self) -> f64 {
        self.corpus.rows() as f64 / self.corpus.demos() as f64
    }

    /// Fresh optimisers; the average starts at the present weights.
    pub fn begin_stage(&mut self) {
        self.updates = 0;
        self.net_descent = Descent::new(self.policy.net.params(), self.settings.ema_decay);
        self.std_descent = Descent::new(&self.policy.log_std, self.settings.ema_decay);
    }

    /// The averaged weights become the weights.
    pub fn end_stage(&mut self) {
        self.policy.net.params_mut().copy_from_slice(self.net_descent.ema.average());
        self.policy.log_std.copy_from_slice(self.std_descent.ema.average());
    }

    /// Transitions of some training demos, one after another, into `rows`.
    pub fn rows_of(&self, demos: &[usize], rows: &mut Vec<usize>) {
        self.corpus.rows_of(demos, rows);
    }

    /// Segments of the last [`Learner::state_cloning`].
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// Algorithm 2 on transitions that amount to `demos` demos.
    ///
    /// # Errors
    /// [`Error::Failed`] when L_BC is not a number.
    pub fn behavior_cloning(&mut self, rows: &[usize], demos: f64) -> Result<Cloned> {
        self.draws += 1;
        let mut rng = stream(self.seed, "train.bc", self.draws);
        let batch = bc::Batch { samples: &self.corpus.policy_samples(&self.policy), rows, demos };
        let cloned = bc::behavior_cloning(&self.policy, batch, &self.bc_choices, &mut rng, &mut self.bc_work);
        self.finite("L_BC (Eq. 3)", cloned.l_bc, "lower train.learning_rate or train.warm_start_learning_rate")?;
        Ok(cloned)
    }

    /// Algorithm 3 on `demos`, whose transitions are `rows`; after [`Learner::behavior_cloning`] on the same.
    ///
    /// # Errors
    /// [`Error::Usage`] without a dynamics network, [`Error::Failed`] when L_SC is not a number.
    pub fn state_cloning(&mut self, demos: &[usize], rows: &[usize]) -> Result<f64> {
        let Some(model) = &mut self.model else {
            return Err(Error::Usage("state cloning needs a dynamics network: run `hilt pretrain` first".into()));
        };
        model.turn();
        let mut rng = stream(self.seed, "train.sc", self.draws);
        let choices = &self.sc_choices;
        let lengths = demos.iter().map(|d| self.corpus.demo(*d).len());
        draw_segments(lengths, choices.rho, choices.pairs, &mut rng, &mut self.segments);
        draw_noise(choices.action == ActionChoice::Sample, rows.len(), &mut rng, &mut self.sc_noise);
        self.pushes.draw(demos.iter().map(|d| self.corpus.demo(*d).len()), &mut rng);
        let batch = sc::Batch {
            corpus: &self.corpus,
            rows,
            demos: demos.len(),
            mean: &self.bc_work.mean,
            noise: &self.sc_noise,
            pushes: self.pushes.rows(),
        };
        let l_sc = sc::state_cloning(&self.policy, &model.dynamics, batch, &self.segments, choices, &mut self.sc_work);
        self.finite(
            "L_SC (Eq. 5)",
            l_sc,
            "raise train.rho, set train.clip_norm, or lower train.learning_rate or train.dynamics_learning_rate",
        )?;
        Ok(l_sc)
    }

    fn finite(&self, term: &str, value: f64, remedy: &str) -> Result<()> {
        if value.is_finite() {
            return Ok(());
        }
        if self.draws == 1 {
            return Err(Error::Failed(before_the_first_update(
                term,
                value,
                "train.initial_std, train.tau and the networks' weights",
            )));
        }
        Err(Error::Failed(format!("{term} is {value} after {} updates of the stage: {remedy}", self.updates)))
    }

    /// Gradient of (1 - alpha) L_BC + alpha L_SC into `self.gradient`.
    fn mixed_gradient(&mut self, bc_weight: f32, sc_weight: f32) {
        let first: &[f32] = if sc_weight > 0.0 { &self.sc_work.d_first } else { &[] };
        policy_gradient(&self.policy, (bc_weight, sc_weight), first, &mut self.bc_work, &mut self.gradient);
        if sc_weight > 0.0 {
            add_scaled(&mut self.gradient, &self.sc_work.gradient, sc_weight);
        }
    }

    /// Norms of the gradients of L_BC and L_SC, each by itself.
    pub fn gradient_norms(&mut self, with_sc: bool) -> (f64, f64) {
        self.mixed_gradient(1.0, 0.0);
        let bc = global_norm(&self.gradient);
        if !with_sc {
            return (bc, f64::NAN);
        }
        self.mixed_gradient(0.0, 1.0);
        (bc, global_norm(&self.gradient))
    }

    /// The loss whose gradient is no use.
    fn unusable_gradient(&mut self, with_sc: bool) -> &'static str {
        let bc = self.gradient_norms(with_sc).0;
        let spread = self.bc_work.d_log_std.iter().all(|d| d.is_finite());
        if with_sc && bc <= LARGEST_NORM && spread { "L_SC (Eq. 5)" } else { "L_BC (Eq. 3)" }
    }

    /// theta <- theta - grad L_mix, by Adam. An update whose gradient is not finite (long rollouts without recovery) is left out.
    pub fn update(&mut self, alpha: f64, sc_scale: f64, learning_rate: f64) {
        self.updates += 1;
        let (bc_weight, sc_weight) = ((1.0 - alpha) as f32, (alpha * sc_scale) as f32);
        self.mixed_gradient(bc_weight, sc_weight);
        let norm = clip_by_global_norm(&mut self.gradient, self.settings.clip_norm);
        let mut d_log_std = self.bc_work.d_log_std;
        if self.settings.action == ActionChoice::Sample {
            let sc = if alpha > 0.0 { self.sc_work.d_log_std } else { Default::default() };
            d_log_std = std::array::from_fn(|i| bc_weight * d_log_std[i] + sc_weight * sc[i]);
        }
        let too_long = self.settings.clip_norm == 0.0 && norm > LARGEST_NORM;
        if !norm.is_finite() || too_long || !d_log_std.iter().all(|d| f64::from(d.abs()) <= LARGEST_NORM) {
            self.skipped += 1;
            self.left_out = self.unusable_gradient(alpha > 0.0);
            return;
        }
        self.net_descent.adam.step(&mut self.policy.net.params_mut(), &self.gradient, learning_rate);
        self.net_descent.ema.update(self.policy.net.params());
        self.std_descent.adam.step(&mut self.policy.log_std, &d_log_std, learning_rate);
        gaussian::floor_log_std(&mut self.policy.log_std, ln(self.settings.std_floor) as f32);
        self.std_descent.ema.update(&self.policy.log_std);
    }

    /// One update of the dynamics network on observed transitions (Eq. 6); L_mix never reaches it.
    ///
    /// # Errors
    /// [`Error::Failed`] when the loss is not a number.
    pub fn fine_tune(&mut self, rows: &[usize]) -> Result<f64> {
        let (mean_length, learning_rate) = (self.mean_length() as f32, self.settings.dynamics_learning_rate);
        let Some(model) = &mut self.model else {
            return Ok(f64::NAN);
        };
        let (l_model, norm) = model.fine_tune(&self.corpus, rows, mean_length, learning_rate);
        let remedy = "lower train.dynamics_learning_rate";
        self.finite("the loss of the dynamics network (Eq. 6)", l_model, remedy)?;
        self.finite("the gradient of the dynamics network's loss (Eq. 6)", norm, remedy)?;
        Ok(l_model)
    }

    /// Brings the policy with the averaged weights up to date.
    pub(super) fn update_averaged(&mut self) {
        self.averaged.net.params_mut().copy_from_slice(self.net_descent.ema.average());
        self.averaged.log_std.copy_from_slice(self.std_descent.ema.average());
    }

    /// Completes an epoch's metrics with the averaged weights' errors on the validation demos.
    pub fn validate(&mut self, mut metrics: EpochMetrics) -> EpochMetrics {
        self.update_averaged();
        let rows: Vec<usize> = (0..self.held_out.rows()).collect();
        let demos = self.held_out.demos() as f64;
        let samples = self.held_out.policy_samples(&self.averaged);
        let batch = bc::Batch { samples: &samples, rows: &rows, demos };
        let mut rng = stream(self.seed, "train.validate", self.draws);
        let work = &mut self.validation_work;
        metrics.validation_l_bc = bc::validate(&self.averaged, batch, &self.bc_choices, &mut rng, work).l_bc;
        let scaling = self.averaged.action_scaling();
        let label = |r: usize, i: usize| scaling.apply(i, self.held_out.commanded(r)[i]);
        metrics.errors = action_errors(label, &work.mean, &scaling.std, &scaling.mean);
        if let Some(model) = &mut self.model {
            metrics.validation_l_model = model.validation_loss(&self.held_out);
        }
        (metrics.updates, metrics.skipped) = (self.updates, self.skipped);
        metrics
    }

    /// The results.
    pub fn finish(self) -> (Policy, Option<Dynamics>) {
        (self.policy, self.model.map(|m| m.dynamics))
    }
}
