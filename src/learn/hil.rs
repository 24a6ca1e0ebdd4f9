//! Algorithm 1: hybrid imitation learning. Pure behavior cloning, pure state cloning and a fixed mixture are the same loop with
//! another alpha.

use super::learner::Learner;
use super::metrics::{EpochMetrics, Mean, table};
use super::policy::Policy;
use super::{Dynamics, pretrain_dynamics::Batches};
use crate::config::{Alpha, TrainSettings};
use crate::demo::Demo;
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use crate::nn::cosine;
use crate::seed::stream;
use crate::table::Table;
use rand::seq::SliceRandom;

/// Which losses teach the policy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Both, mixed by alpha as the settings say.
    Hil,
    /// alpha = 0: L_BC alone.
    Bc,
    /// alpha = 1: L_SC alone, and no warm start.
    Sc,
}

impl Method {
    /// alpha of Eq. 1.
    fn alpha(self, settings: &TrainSettings) -> Alpha {
        match self {
            Method::Hil => settings.alpha,
            Method::Bc => Alpha::Fixed(0.0),
            Method::Sc => Alpha::Fixed(1.0),
        }
    }
}

/// What training leaves behind.
#[derive(Clone, Debug)]
pub struct Trained {
    /// pi_theta, averaged weights.
    pub policy: Policy,
    /// f_phi, fine-tuned if the settings say so.
    pub dynamics: Option<Dynamics>,
    /// One row an epoch.
    pub metrics: Table,
}

/// Trains a policy on `train`; `log` is called after every epoch.
///
/// # Errors
/// [`Error::Usage`] for a setting out of range or a missing dynamics network; [`Error::Failed`] without demos, for a dynamics network
/// of another task, or when a loss is not a number; [`Error::Interrupted`].
#[allow(clippy::too_many_arguments, reason = "each is a separate input of the stage")]
pub fn train(
    method: Method,
    train: &[Demo],
    validation: &[Demo],
    dynamics: Option<Dynamics>,
    settings: &TrainSettings,
    seed: u64,
    log: &mut dyn FnMut(&EpochMetrics),
    interrupt: &Interrupt,
) -> Result<Trained> {
    settings.validate()?;
    let alpha = method.alpha(settings);
    if alpha != Alpha::Fixed(0.0) && dynamics.is_none() {
        return Err(Error::Usage("state cloning needs a dynamics network: run `hilt pretrain` first, or train with bc".into()));
    }
    let mut learner = Learner::new(train, validation, dynamics, settings, seed)?;
    let mut epochs = Vec::new();
    let mut log = |metrics: EpochMetrics| {
        log(&metrics);
        epochs.push(metrics);
    };
    if method != Method::Sc {
        warm_start(&mut learner, settings, &mut log, interrupt)?;
    }
    hybrid_imitation_learning(&mut learner, alpha, settings, &mut log, interrupt)?;
    let (policy, dynamics) = learner.finish();
    Ok(Trained { policy, dynamics, metrics: table(&epochs) })
}

/// Behavior cloning on pairs shuffled across demos: d_conv passes .9 within a few hundred updates of Algorithm 1, which starves L_BC
/// before the rare phases of a task are learned.
fn warm_start(
    learner: &mut Learner,
    settings: &TrainSettings,
    log: &mut impl FnMut(EpochMetrics),
    interrupt: &Interrupt,
) -> Result<()> {
    let per_epoch = Batches::new(&learner.corpus, settings.bc_batch).per_epoch();
    let total = settings.warm_start_updates;
    learner.begin_stage();
    for epoch in 0..total.div_ceil(per_epoch) {
        let batches = Batches::new(&learner.corpus, settings.bc_batch);
        let shuffled = batches.shuffled(&mut stream(learner.seed, "train.warm-start", epoch));
        let (mut l_bc, mut d_conv) = (Mean::default(), Mean::default());
        let mut metrics = EpochMetrics::new("warm-start", epoch + 1, total.div_ceil(per_epoch));
        for rows in shuffled.iter().take((total - learner.updates) as usize) {
            interrupt.check()?;
            let cloned = learner.behavior_cloning(rows, rows.len() as f64 / learner.mean_length())?;
            metrics.learning_rate =
                cosine(settings.warm_start_learning_rate, settings.final_learning_rate, learner.updates, total);
            learner.update(0.0, metrics.learning_rate);
            l_bc.add(cloned.l_bc);
            d_conv.add(cloned.d_conv);
        }
        (metrics.l_bc, metrics.l_mix, metrics.d_conv, metrics.alpha) = (l_bc.get(), l_bc.get(), d_conv.get(), 0.0);
        log(learner.validate(metrics));
    }
    learner.end_stage();
    Ok(())
}

fn hybrid_imitation_learning(
    learner: &mut Learner,
    alpha: Alpha,
    settings: &TrainSettings,
    log: &mut impl FnMut(EpochMetrics),
    interrupt: &Interrupt,
) -> Result<()> {
    let mut order: Vec<usize> = (0..learner.corpus.demos()).collect();
    let batch = settings.batch.min(order.len());
    let per_epoch = order.len().div_ceil(batch) as u64;
    let mut mixing = Mixing::new(alpha, settings, per_epoch);
    let mut rows = Vec::new();
    learner.begin_stage();
    for epoch in 0..settings.epochs {
        order.shuffle(&mut stream(learner.seed, "train.order", epoch));
        let [mut l_bc, mut l_sc, mut l_mix, mut d_conv, mut alphas, mut l_model] = [Mean::default(); 6];
        let mut metrics = EpochMetrics::new("hil", epoch + 1, settings.epochs);
        for (i, demos) in order.chunks(batch).enumerate() {
            interrupt.check()?;
            learner.rows_of(demos, &mut rows);
            let cloned = learner.behavior_cloning(&rows, demos.len() as f64)?; // Algorithm 2, Eq. 3-4
            let alpha = mixing.weight(cloned.d_conv); // alpha_e = d_conv, no gradient through it
            let sc = if alpha > 0.0 { learner.state_cloning(demos, &rows)? } else { f64::NAN }; // Algorithm 3, Eq. 5
            let mixed = if alpha > 0.0 { (1.0 - alpha) * cloned.l_bc + alpha * sc } else { cloned.l_bc }; // Eq. 1
            if i == 0 {
                (metrics.grad_bc, metrics.grad_sc) = learner.gradient_norms(alpha > 0.0);
            }
            let step = epoch * per_epoch + i as u64;
            let rate = cosine(settings.learning_rate, settings.final_learning_rate, step, settings.epochs * per_epoch);
            learner.update(alpha, rate); // Eq. 2
            if settings.fine_tune_dynamics && mixing.alpha != Alpha::Fixed(0.0) {
                l_model.add(learner.fine_tune(&rows)?); // Eq. 6, on observed transitions only
            }
            for (mean, value) in [(&mut l_bc, cloned.l_bc), (&mut l_sc, sc), (&mut l_mix, mixed)] {
                mean.add(value);
            }
            d_conv.add(cloned.d_conv);
            alphas.add(alpha);
            metrics.learning_rate = rate;
        }
        (metrics.l_bc, metrics.l_sc, metrics.l_mix) = (l_bc.get(), l_sc.get(), l_mix.get());
        (metrics.d_conv, metrics.alpha, metrics.l_model) = (d_conv.get(), alphas.get(), l_model.get());
        log(learner.validate(metrics));
    }
    learner.end_stage();
    Ok(())
}

/// alpha of Eq. 1 from update to update.
struct Mixing {
    alpha: Alpha,
    cap: f64,
    /// Share of the past in the average; 0 follows d_conv at once.
    keep: f64,
    average: Option<f64>,
}

impl Mixing {
    fn new(alpha: Alpha, settings: &TrainSettings, updates_per_epoch: u64) -> Self {
        let keep = if settings.alpha_average { 1.0 - 1.0 / updates_per_epoch.max(1) as f64 } else { 0.0 };
        Mixing { alpha, cap: settings.alpha_max, keep, average: None }
    }

    fn weight(&mut self, d_conv: f64) -> f64 {
        match self.alpha {
            Alpha::Fixed(alpha) => alpha,
            Alpha::Adaptive => {
                let now = d_conv.clamp(0.0, 1.0);
                let average = self.average.map_or(now, |past| self.keep * past + (1.0 - self.keep) * now);
                self.average = Some(average);
                average.min(self.cap)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alpha_follows_d_conv_within_its_bounds() {
        let mut settings = TrainSettings { alpha_max: 0.6, alpha_average: false, ..Default::default() };
        let mut mixing = Mixing::new(Alpha::Adaptive, &settings, 10);
        assert_eq!([0.2, 0.9, 7.0].map(|d| mixing.weight(d)), [0.2, 0.6, 0.6]);
        settings.alpha_average = true;
        let mut mixing = Mixing::new(Alpha::Adaptive, &settings, 10);
        assert_eq!(mixing.weight(0.0), 0.0);
        assert!((mixing.weight(1.0) - 0.1).abs() < 1e-12);
        assert_eq!(Mixing::new(Alpha::Fixed(0.3), &settings, 10).weight(1.0), 0.3);
    }
}
