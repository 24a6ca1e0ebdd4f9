//! Algorithm 1: hybrid imitation learning. Pure behavior cloning, pure state cloning and a fixed mixture are the same loop with
//! another alpha.

use super::learner::Learner;
use super::metrics::{EpochMetrics, HIL, Mean, WARM_START};
use super::policy::Policy;
use super::run::{Hooks, Run};
use super::selection::Selection;
use super::{Dynamics, pretrain_dynamics::Batches};
use crate::config::{Alpha, FingerCloning, TrainSettings};
use crate::demo::Demo;
use crate::error::{Error, Result};
use crate::math;
use crate::nn::cosine;
use crate::seed::stream;
use crate::table::Table;
use crate::words::{did_you_mean, shown};
use rand::seq::SliceRandom;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::str::FromStr;

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
    /// All methods.
    pub const ALL: [Method; 3] = [Method::Hil, Method::Bc, Method::Sc];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        ["hil", "bc", "sc"][self as usize]
    }

    /// alpha of Eq. 1.
    fn alpha(self, settings: &TrainSettings) -> Alpha {
        match self {
            Method::Hil => settings.alpha,
            Method::Bc => Alpha::Fixed(0.0),
            Method::Sc => Alpha::Fixed(1.0),
        }
    }
}

impl FromStr for Method {
    type Err = String;

    fn from_str(s: &str) -> std::result::Result<Self, String> {
        Method::ALL.into_iter().find(|m| m.name() == s).ok_or_else(|| {
            let hint = did_you_mean(s, Method::ALL.map(Method::name));
            let s = shown(s);
            format!("unknown method \"{s}\"{hint}; allowed: hil (both losses), bc (behavior cloning), sc (state cloning)")
        })
    }
}

/// What training leaves behind.
#[derive(Clone, Debug)]
pub struct Trained {
    /// pi_theta, averaged weights: the last, or the one that rollouts have chosen.
    pub policy: Policy,
    /// f_phi, fine-tuned if the settings say so.
    pub dynamics: Option<Dynamics>,
    /// One row an epoch.
    pub metrics: Table,
    /// How the policy was chosen, with `train.select_episodes` above 0.
    pub selection: Option<Selection>,
}

/// Trains a policy on `train`. A run that goes on from a checkpoint of the same run ends with the same bits.
///
/// # Errors
/// [`Error::Usage`] for a setting out of range or a missing dynamics network; [`Error::Failed`] without demos, for a dynamics network
/// of another task, a checkpoint that does not fit, or when a loss is not a number; [`Error::Interrupted`]; what rollouts return.
pub fn train<'a>(
    method: Method,
    train: impl Into<Cow<'a, [Demo]>>,
    validation: impl Into<Cow<'a, [Demo]>>,
    dynamics: Option<Dynamics>,
    settings: &TrainSettings,
    seed: u64,
    hooks: Hooks,
) -> Result<Trained> {
    settings.validate()?;
    let alpha = method.alpha(settings);
    if alpha != Alpha::Fixed(0.0) && dynamics.is_none() {
        return Err(Error::Usage("state cloning needs a dynamics network: run `hilt pretrain` first, or train with bc".into()));
    }
    let settings = &with_a_teacher_for_the_fingers(settings, alpha);
    let mut run = Run::new(Learner::new(train, validation, dynamics, settings, seed)?, settings, hooks)?;
    let warm = method != Method::Sc && !run.reached(HIL);
    let warmed = if warm { warm_start(&mut run, settings) } else { Ok(()) };
    match warmed.and_then(|()| hybrid_imitation_learning(&mut run, alpha, settings)) {
        Ok(()) => Ok(run.finish()),
        Err(why) => {
            run.keep_last();
            Err(why)
        }
    }
}

/// Commands of fingers that do not follow are left to L_BC; where L_BC has no weight, they stay with L_SC.
fn with_a_teacher_for_the_fingers(settings: &TrainSettings, alpha: Alpha) -> TrainSettings {
    let left_to_bc = settings.sc_fingers == FingerCloning::Following && alpha == Alpha::Fixed(1.0);
    TrainSettings { sc_fingers: if left_to_bc { FingerCloning::All } else { settings.sc_fingers }, ..settings.clone() }
}

/// Behavior cloning on pairs shuffled across demos: d_conv passes .9 within a few hundred updates of Algorithm 1, which starves L_BC
/// before the rare phases of a task are learned.
fn warm_start(run: &mut Run, settings: &TrainSettings) -> Result<()> {
    let per_epoch = Batches::new(&run.learner.corpus, settings.bc_batch).per_epoch();
    let total = settings.warm_start_updates;
    for epoch in run.enter(WARM_START)..total.div_ceil(per_epoch) {
        let batches = Batches::new(&run.learner.corpus, settings.bc_batch);
        let shuffled = batches.shuffled(&mut stream(run.learner.seed, "train.warm-start", epoch));
        let (mut l_bc, mut d_conv) = (Mean::default(), Mean::default());
        let mut metrics = EpochMetrics::new(WARM_START, epoch + 1, total.div_ceil(per_epoch));
        for rows in shuffled.iter().take(total.saturating_sub(run.learner.updates) as usize) {
            run.check()?;
            let learner = &mut run.learner;
            let cloned = learner.behavior_cloning(rows, rows.len() as f64 / learner.mean_length())?;
            metrics.learning_rate =
                cosine(settings.warm_start_learning_rate, settings.final_learning_rate, learner.updates, total);
            learner.update(0.0, 1.0, metrics.learning_rate);
            l_bc.add(cloned.l_bc);
            d_conv.add(cloned.d_conv);
        }
        (metrics.l_bc, metrics.l_mix, metrics.d_conv, metrics.alpha) = (l_bc.get(), l_bc.get(), d_conv.get(), 0.0);
        run.end_epoch(metrics, Averages::default())?;
    }
    run.learner.end_stage();
    Ok(())
}

fn hybrid_imitation_learning(run: &mut Run, alpha: Alpha, settings: &TrainSettings) -> Result<()> {
    let seed = run.learner.seed;
    let mut order: Vec<usize> = (0..run.learner.corpus.demos()).collect();
    let batch = settings.batch.min(order.len());
    let per_epoch = order.len().div_ceil(batch) as u64;
    let epochs = settings.epochs_of(per_epoch);
    let mut mixing = Mixing { averages: run.averages(), ..Mixing::new(alpha, settings, per_epoch) };
    let mut rows = Vec::new();
    let done = run.enter(HIL);
    // Each epoch shuffles the order of the one before.
    (0..done).for_each(|past| order.shuffle(&mut stream(seed, "train.order", past)));
    for epoch in done..epochs {
        order.shuffle(&mut stream(seed, "train.order", epoch));
        let [mut l_bc, mut l_sc, mut l_mix, mut d_conv, mut alphas, mut l_model] = [Mean::default(); 6];
        let mut metrics = EpochMetrics::new(HIL, epoch + 1, epochs);
        for (i, demos) in order.chunks(batch).enumerate() {
            run.check()?;
            let learner = &mut run.learner;
            learner.rows_of(demos, &mut rows);
            let cloned = learner.behavior_cloning(&rows, demos.len() as f64)?; // Algorithm 2, Eq. 3-4
            let alpha = mixing.weight(cloned.d_conv); // alpha_e = d_conv, no gradient through it
            let sc = if alpha > 0.0 { learner.state_cloning(demos, &rows)? } else { f64::NAN }; // Algorithm 3, Eq. 5
            if i == 0 {
                (metrics.grad_bc, metrics.grad_sc) = learner.gradient_norms(alpha > 0.0);
                mixing.see_norms(metrics.grad_bc, metrics.grad_sc);
            }
            let scale = mixing.sc_scale();
            let mixed = if alpha > 0.0 { (1.0 - alpha) * cloned.l_bc + alpha * scale * sc } else { cloned.l_bc }; // Eq. 1
            let step = epoch * per_epoch + i as u64;
            let rate = cosine(settings.learning_rate, settings.final_learning_rate, step, epochs * per_epoch);
            learner.update(alpha, scale, rate); // Eq. 2
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
        run.end_epoch(metrics, mixing.averages)?;
    }
    run.learner.end_stage();
    Ok(())
}

/// alpha of Eq. 1 from update to update.
struct Mixing {
    alpha: Alpha,
    cap: f64,
    /// Share of the past in the average; 0 follows d_conv at once.
    keep: f64,
    averages: Averages,
    /// Whether the gradient of L_SC is scaled to the length of that of L_BC.
    balance: bool,
}

/// What of [`Mixing`] goes on from epoch to epoch.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Averages {
    /// Of d_conv.
    d_conv: Option<f64>,
    /// Mean of the logarithm of the ratio of the two gradients' lengths, over the last epochs.
    log_ratio: Option<f64>,
}

impl Averages {
    /// Those of d_conv and of the logarithm, where there are any.
    pub(super) fn known(self) -> (Option<f64>, Option<f64>) {
        (self.d_conv, self.log_ratio)
    }
}

/// Share of the past in the mean ratio of the gradients' lengths, which is measured once an epoch.
const RATIO_KEEP: f64 = 0.8;

impl Mixing {
    fn new(alpha: Alpha, settings: &TrainSettings, updates_per_epoch: u64) -> Self {
        let keep = if settings.alpha_average { 1.0 - 1.0 / updates_per_epoch.max(1) as f64 } else { 0.0 };
        Mixing { alpha, cap: settings.alpha_max, keep, averages: Averages::default(), balance: settings.sc_balance }
    }

    /// Takes in the lengths of the gradients of L_BC and L_SC at an epoch's first update.
    fn see_norms(&mut self, bc: f64, sc: f64) {
        let now = math::ln(bc / sc);
        if now.is_finite() {
            let past = self.averages.log_ratio;
            self.averages.log_ratio = Some(past.map_or(now, |past| RATIO_KEEP * past + (1.0 - RATIO_KEEP) * now));
        }
    }

    /// Factor of L_SC.
    fn sc_scale(&self) -> f64 {
        if self.balance { self.averages.log_ratio.map_or(1.0, math::exp) } else { 1.0 }
    }

    fn weight(&mut self, d_conv: f64) -> f64 {
        match self.alpha {
            Alpha::Fixed(alpha) => alpha,
            Alpha::Adaptive => {
                let now = d_conv.clamp(0.0, 1.0);
                let average = self.averages.d_conv.map_or(now, |past| self.keep * past + (1.0 - self.keep) * now);
                self.averages.d_conv = Some(average);
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

    #[test]
    fn without_l_bc_no_finger_is_left_alone() {
        let of = |sc_fingers, alpha| {
            with_a_teacher_for_the_fingers(&TrainSettings { sc_fingers, ..Default::default() }, alpha).sc_fingers
        };
        assert_eq!(of(FingerCloning::Following, Alpha::Fixed(1.0)), FingerCloning::All);
        assert_eq!(of(FingerCloning::Following, Alpha::Adaptive), FingerCloning::Following);
        assert_eq!(of(FingerCloning::None, Alpha::Fixed(1.0)), FingerCloning::None);
    }

    #[test]
    fn l_sc_is_scaled_to_the_gradient_of_l_bc() {
        let settings = TrainSettings { sc_balance: true, ..Default::default() };
        let mut mixing = Mixing::new(Alpha::Adaptive, &settings, 10);
        assert_eq!(mixing.sc_scale(), 1.0);
        mixing.see_norms(0.2, 20.0);
        assert!((mixing.sc_scale() - 0.01).abs() < 1e-12);
        mixing.see_norms(0.2, f64::NAN);
        mixing.see_norms(0.2, 2.0);
        assert!((math::log10(mixing.sc_scale()) + 1.8).abs() < 1e-12, "{}", mixing.sc_scale());
    }

    #[test]
    fn few_demos_get_more_epochs() {
        let settings = TrainSettings { epochs: 60, min_updates: 2000, ..Default::default() };
        assert_eq!([3, 34, 100].map(|per_epoch| settings.epochs_of(per_epoch)), [667, 60, 60]);
        assert_eq!(TrainSettings { epochs: 0, ..settings }.epochs_of(3), 0);
    }
}
