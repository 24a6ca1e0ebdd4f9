//! Algorithm 1: hybrid imitation learning. Pure behavior cloning, pure state cloning and a fixed mixture are the same loop with
//! another alpha. Line by line:
//!
//! | Function HIL(D, rho) | here |
//! |---|---|
//! | initialise pi_theta and f_phi | `Hil::new`, `Dynamics::new` |
//! | f_phi = Pretrain_Dynamics_Network(f_phi, D, E) | `pretrain_dynamics` (Algorithm 4), before: `hilt pretrain` |
//! | for e = 0 ... E | the stages of `Hil` (`stages.rs`), gone through by `learn::run` |
//! | for i = 0 ... the number of demos: sample d from D | `hybrid_imitation_learning` |
//! | L_BC, d_conv; L_SC; L_mix; theta <- theta - grad L_mix | `Hil::update` |
//! | return pi_theta | the policy that `learn::run` selects |

mod metrics;
mod stages;
mod warm_start;

pub use metrics::METRICS;

use super::descent::Descent;
use super::fine_tuning::FineTuning;
use super::inputs::Inputs;
use super::mixing::Mixing;
use crate::config::{Alpha, FingerCloning, TrainSettings};
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use crate::learn::limits::{affordable, before_the_first_update};
use crate::learn::losses::behavior_cloning as bc;
use crate::learn::losses::state_cloning::Segment;
use crate::learn::losses::{Acted, Offsets, PolicyLoss, StateCloning, behavior_cloning};
use crate::learn::models::{Corpus, Dynamics, Policy, PolicySamples};
use crate::learn::run::{EpochMetrics, Mean, Stage};
use crate::nn::cosine;
use crate::seed::stream;
use rand::seq::SliceRandom;

/// Behavior cloning alone, before Algorithm 1: d_conv passes .9 within a few hundred updates of Algorithm 1, which starves L_BC before
/// the rare phases of a task are learned.
pub const WARM_START: &str = "warm-start";
/// Algorithm 1.
pub const HIL: &str = "hil";
/// The random stream of `[train.randomise]`.
const OFFSETS: &str = "train.randomise";

/// HIL, its two parts, and any fixed mixture of them.
pub struct Hil {
    seed: u64,
    settings: TrainSettings,
    inputs: Inputs,
    descent: Descent,
    model: Option<FineTuning>,
    mixing: Mixing,
    /// Demos in the order of the last epoch, each of which shuffles that of the one before, and how often they were shuffled.
    order: (Vec<usize>, u64),
    /// Updates of all stages: the number of the random streams.
    draws: u64,
    work: Work,
}

/// What an update needs room for.
struct Work {
    rows: Vec<usize>,
    acted: Acted,
    offsets: Offsets,
    bc_choices: bc::Choices,
    bc_work: bc::Workspace,
    sc: StateCloning,
}

/// What an update of Algorithm 1 reports; NaN where it was not computed.
#[derive(Clone, Copy, Debug)]
pub struct Update {
    /// L_BC, Eq. 3.
    pub l_bc: f64,
    /// L_SC, Eq. 5.
    pub l_sc: f64,
    /// L_mix, Eq. 1.
    pub l_mix: f64,
    /// d_conv, Eq. 4.
    pub d_conv: f64,
    /// alpha.
    pub alpha: f64,
    /// L_model, Eq. 6.
    pub l_model: f64,
}

impl Hil {
    /// A fresh policy for these demos. Without a dynamics network alpha must be 0.
    ///
    /// # Errors
    /// [`Error::Usage`] for a missing dynamics network or batches that memory cannot hold; [`Error::Failed`] when layouts differ.
    pub fn new(inputs: Inputs, dynamics: Option<Dynamics>, alpha: Alpha, settings: &TrainSettings, seed: u64) -> Result<Self> {
        if alpha != Alpha::Fixed(0.0) && dynamics.is_none() {
            let help = "state cloning needs a dynamics network: run `hilt pretrain` first, or train with bc";
            return Err(Error::Usage(help.into()));
        }
        inputs.same_layout(dynamics.as_ref().map(|dynamics| &**dynamics.layout()))?;
        let settings = with_a_teacher_for_the_fingers(settings, alpha);
        let (corpus, units) = (&inputs.train, settings.hidden_units);
        let most_rows = settings.bc_batch.max(settings.batch * corpus.longest()).min(corpus.rows());
        affordable(most_rows, settings.hidden_layers, units, "train.batch, train.bc_batch or train.hidden_units")?;
        let policy = Policy::new(corpus, &settings, &mut stream(seed, "train.init", 0));
        let work = Work {
            rows: Vec::with_capacity(most_rows),
            acted: Acted::new(&policy, most_rows),
            offsets: Offsets::new(&settings.randomise, policy.features())?,
            bc_choices: bc::Choices::new(&settings),
            bc_work: bc::Workspace::new(corpus.layout.action_dim(), most_rows),
            sc: StateCloning::new(&settings, corpus, most_rows),
        };
        let per_epoch = per_epoch(corpus, &settings);
        Ok(Hil {
            seed,
            descent: Descent::new(policy, &settings),
            model: dynamics.map(FineTuning::new),
            mixing: Mixing::new(alpha, &settings, per_epoch),
            order: ((0..corpus.demos()).collect(), 0),
            draws: 0,
            work,
            inputs,
            settings,
        })
    }

    /// An epoch of Algorithm 1.
    fn hybrid_imitation_learning(&mut self, stage: Stage, epoch: u64, interrupt: &Interrupt) -> Result<EpochMetrics> {
        let (per_epoch, order) = (per_epoch(&self.inputs.train, &self.settings), self.shuffled(epoch));
        let (first, last, steps) = (self.settings.learning_rate, self.settings.final_learning_rate, stage.epochs * per_epoch);
        let (mut row, mut means) = (EpochMetrics::new(HIL, epoch + 1, stage.epochs), [Mean::default(); 5]);
        let (mut l_model, mut rate) = (Mean::default(), f64::NAN);
        for (i, demos) in order.chunks(self.settings.batch.min(order.len())).enumerate() {
            interrupt.check()?;
            rate = cosine(first, last, epoch * per_epoch + i as u64, steps);
            let update = self.update(demos, rate, (i == 0).then_some(&mut row))?;
            let Update { l_bc, l_sc, l_mix, d_conv, alpha, .. } = update;
            means.iter_mut().zip([l_bc, l_sc, l_mix, d_conv, alpha]).for_each(|(mean, value)| mean.add(value));
            if !update.l_model.is_nan() {
                l_model.add(update.l_model);
            }
        }
        let names = ["l_bc", "l_sc", "l_mix", "d_conv", "alpha"];
        names.iter().zip(means).for_each(|(name, mean)| row.set(name, mean.get()));
        row.set("l_model", l_model.get());
        row.set("learning_rate", rate);
        self.order = (order, epoch + 1);
        Ok(row)
    }

    /// One update of Algorithm 1 on `demos`, numbers of training demos: d of the paper, of which several may be taken at once. With `norms` the
    /// lengths of both gradients are measured and reported there.
    ///
    /// # Errors
    /// [`Error::Failed`] when a loss is not a number.
    pub fn update(&mut self, demos: &[usize], learning_rate: f64, norms: Option<&mut EpochMetrics>) -> Result<Update> {
        self.draws += 1;
        let (finite, seed, draws) = (self.judge(), self.seed, self.draws);
        let rng = |name| stream(seed, name, draws);
        let Hil { inputs: Inputs { train, .. }, descent, model: f_phi, mixing, work, .. } = self;
        let Work { rows, acted, offsets, bc_choices, bc_work, sc } = work;
        train.rows_of(demos, rows);
        let samples = PolicySamples { corpus: train, policy: &descent.policy };

        // pi_theta in the states of d, where both losses begin
        acted.forward(samples, rows, Some(offsets.draw(rows.len(), &mut rng(OFFSETS))));

        // L_BC, d_conv = Behavior_Cloning(pi_theta, d): Algorithm 2, Eq. 3 and 4
        let d = bc::Batch { samples, rows, demos: demos.len() as f64 };
        let (l_bc, d_conv) = behavior_cloning(acted, d, bc_choices, &mut rng("train.bc"), bc_work);
        finite(l_bc.name, l_bc.value, BC_REMEDY)?;
        let alpha = mixing.weight(d_conv); // alpha_e = d_conv; no gradient goes through it

        // L_SC = State_Cloning(pi_theta, f_phi, d, rho): Algorithm 3, Eq. 5
        let l_sc = f_phi.as_ref().filter(|_| alpha > 0.0).map(|f_phi| {
            let networks = (&descent.policy, &f_phi.dynamics);
            sc.run(networks, acted, (train, demos, rows), &mut rng("train.sc"))
        });
        l_sc.map_or(Ok(()), |l_sc| finite(l_sc.name, l_sc.value, SC_REMEDY))?;
        if let Some(row) = norms {
            measure(descent, acted, [Some(l_bc), l_sc], mixing, row);
        }

        // L_mix = Loss_Mixing(L_BC, L_SC, d_conv): Eq. 1
        let l_mix = match l_sc {
            Some(l_sc) => (1.0 - alpha) * l_bc + alpha * mixing.sc_scale() * l_sc,
            None => (1.0 - alpha) * l_bc,
        };

        // theta <- theta - grad L_mix: Eq. 2
        descent.update(acted, l_mix, learning_rate);

        // f_phi goes on learning, from observed transitions only: Eq. 6
        let l_model = match f_phi.as_mut().filter(|_| self.settings.fine_tune_dynamics && mixing.has_sc()) {
            Some(f_phi) => {
                let (l_model, norm) = f_phi.update(train, rows, self.settings.dynamics_learning_rate);
                finite("the loss of the dynamics network (Eq. 6)", l_model, MODEL_REMEDY)?;
                finite("the gradient of the dynamics network's loss (Eq. 6)", norm, MODEL_REMEDY)?;
                l_model
            }
            None => f64::NAN,
        };
        let l_sc = l_sc.map_or(f64::NAN, |l_sc| l_sc.value);
        Ok(Update { l_bc: l_bc.value, l_sc, l_mix: l_mix.value(), d_conv, alpha, l_model })
    }

    /// The order of the demos in an epoch.
    fn shuffled(&mut self, epoch: u64) -> Vec<usize> {
        let (mut order, mut shuffles) = std::mem::take(&mut self.order);
        if shuffles > epoch || order.is_empty() {
            (order, shuffles) = ((0..self.inputs.train.demos()).collect(), 0);
        }
        (shuffles..=epoch).for_each(|past| order.shuffle(&mut stream(self.seed, "train.order", past)));
        order
    }

    /// Refuses a loss that is not a number.
    fn judge(&self) -> impl Fn(&str, f64, &str) -> Result<()> + use<> {
        let (first, updates) = (self.draws == 1, self.descent.updates);
        move |term, value, remedy| match value.is_finite() {
            true => Ok(()),
            false if first => {
                let settings = "train.initial_std, train.tau and the networks' weights";
                Err(Error::Failed(before_the_first_update(term, value, settings)))
            }
            false => Err(Error::Failed(format!("{term} is {value} after {updates} updates of the stage: {remedy}"))),
        }
    }

    /// The policy as it stands.
    pub(super) fn policy(&self) -> &Policy {
        &self.descent.policy
    }

    /// What it learns from.
    pub(super) fn demos(&self) -> &Corpus {
        &self.inputs.train
    }

    /// The policy, to be spoilt.
    #[cfg(test)]
    pub fn policy_mut(&mut self) -> &mut Policy {
        &mut self.descent.policy
    }

    /// What an update works on: for its cost.
    pub(super) fn parts(&self) -> (&Policy, Option<&Dynamics>, &[Segment]) {
        (&self.descent.policy, self.model.as_ref().map(|model| &model.dynamics), self.work.sc.segments())
    }
}

const BC_REMEDY: &str = "lower train.learning_rate or train.warm_start_learning_rate";
const SC_REMEDY: &str = "raise train.rho, set train.clip_norm, or lower train.learning_rate or train.dynamics_learning_rate";
const MODEL_REMEDY: &str = "lower train.dynamics_learning_rate";

/// Measures and reports the lengths of the gradients of L_BC and L_SC, by which they are balanced.
fn measure(
    descent: &mut Descent,
    acted: &mut Acted,
    losses: [Option<&PolicyLoss>; 2],
    mixing: &mut Mixing,
    row: &mut EpochMetrics,
) {
    let [bc, sc] = losses.map(|loss| loss.map_or(f64::NAN, |loss| descent.gradient_norm(acted, 1.0 * loss)));
    mixing.see_norms(bc, sc);
    row.set("grad_bc", bc);
    row.set("grad_sc", sc);
}

/// Updates of an epoch of Algorithm 1.
fn per_epoch(corpus: &Corpus, settings: &TrainSettings) -> u64 {
    corpus.demos().div_ceil(settings.batch.min(corpus.demos())) as u64
}

/// Commands of fingers that do not follow are left to L_BC; where L_BC has no weight, L_SC reaches them straight through.
fn with_a_teacher_for_the_fingers(settings: &TrainSettings, alpha: Alpha) -> TrainSettings {
    let mut settings = settings.clone();
    if settings.sc.fingers == FingerCloning::Following && alpha == Alpha::Fixed(1.0) {
        settings.sc.fingers = FingerCloning::StraightThrough;
    }
    settings
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::ScSettings;

    #[test]
    fn without_l_bc_no_finger_is_left_alone() {
        let of = |fingers, alpha| {
            let sc = ScSettings { fingers, ..Default::default() };
            with_a_teacher_for_the_fingers(&TrainSettings { sc, ..Default::default() }, alpha).sc.fingers
        };
        assert_eq!(of(FingerCloning::Following, Alpha::Fixed(1.0)), FingerCloning::StraightThrough);
        assert_eq!(of(FingerCloning::All, Alpha::Fixed(1.0)), FingerCloning::All);
        assert_eq!(of(FingerCloning::Following, Alpha::Adaptive), FingerCloning::Following);
        assert_eq!(of(FingerCloning::None, Alpha::Fixed(1.0)), FingerCloning::None);
    }

    #[test]
    fn few_demos_get_more_epochs() {
        let settings = TrainSettings { epochs: 60, min_updates: 2000, ..Default::default() };
        assert_eq!([3, 34, 100].map(|per_epoch| settings.epochs_of(per_epoch)), [667, 60, 60]);
        assert_eq!(TrainSettings { epochs: 0, ..settings }.epochs_of(3), 0);
    }
}
