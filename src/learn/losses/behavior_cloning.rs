//! Algorithm 2: behavior cloning. L_BC (Eq. 3) over the states of the demos, and the degree of policy convergence d_conv there
//! ([`super::convergence`]).

use super::acted::{Acted, Shard};
use super::convergence::p_t;
use super::policy_loss::PolicyLoss;
use super::shards;
use crate::config::{ActionChoice, Convergence, Objective, TrainSettings};
use crate::learn::models::{PolicySamples, Samples, row};
use crate::math::exp_f32;
use crate::nn::{BLOCK_PANELS, LANES, Lanes, Panels, gaussian, panels_of};
use crate::seed::normal;
use rand::Rng;
use rayon::prelude::*;

/// The state-action pairs of one update.
#[derive(Clone, Copy)]
pub struct Batch<'a> {
    /// Policy and demos.
    pub samples: PolicySamples<'a>,
    /// Transitions of the demos.
    pub rows: &'a [usize],
    /// Number of demos that they amount to.
    pub demos: f64,
}

/// The keys that shape L_BC and d_conv.
#[derive(Clone, Copy, Debug)]
pub struct Choices {
    action: ActionChoice,
    objective: Objective,
    convergence: Convergence,
    tau: f32,
}

impl Choices {
    /// From the settings.
    pub fn new(settings: &TrainSettings) -> Self {
        Choices { action: settings.action, objective: settings.loss, convergence: settings.d_conv, tau: settings.tau as f32 }
    }
}

/// Rows of a validation that are in memory at a time: what each shard's pass keeps then waits in a core's second cache.
const VALIDATION_ROWS: usize = shards::MAX_SHARDS * BLOCK_PANELS * LANES;

/// The workspace.
pub struct Workspace {
    loss: PolicyLoss,
    parts: Vec<Part>,
    noise: Vec<f32>,
    residual2: Vec<f32>,
}

/// What one shard adds to the sums.
#[derive(Default)]
struct Part {
    noise: Panels,
    loss: f64,
    agreement: f64,
    /// Of each entry of the actions, as what follows.
    residual2: Vec<f32>,
    d_log_std: Vec<f32>,
    sigma: Vec<f32>,
}

impl Workspace {
    /// For actions of `dim` entries, with room for batches of at most `most_rows` state-action pairs.
    pub fn new(dim: usize, most_rows: usize) -> Self {
        let part = || {
            let [residual2, d_log_std, sigma] = std::array::from_fn(|_| vec![0.0; dim]);
            let mut part = Part { residual2, d_log_std, sigma, ..Part::default() };
            part.noise.reserve(dim, panels_of(shards::most_rows(most_rows)));
            part
        };
        let parts = (0..shards::MAX_SHARDS).map(|_| part()).collect();
        let (noise, residual2) = (Vec::with_capacity(most_rows * dim), vec![0.0; dim]);
        Workspace { loss: PolicyLoss::new("L_BC (Eq. 3)", dim, most_rows), parts, noise, residual2 }
    }
}

/// Algorithm 2 over a batch in whose states the policy has `acted`: L_BC with its gradient, and d_conv. `rng` draws the samples
/// a_t ~ pi_theta(s_t^E) where the settings ask for them; p_t always comes from the mean unless it is the sampled density.
///
/// # Panics
/// When the policy has acted in another number of states.
pub fn behavior_cloning<'a>(
    acted: &Acted,
    batch: Batch,
    choices: &Choices,
    rng: &mut impl Rng,
    work: &'a mut Workspace,
) -> (&'a PolicyLoss, f64) {
    let (rows, Workspace { loss, parts, noise, residual2 }) = (batch.rows.len(), work);
    let dim = residual2.len();
    assert_eq!(acted.mean().len(), rows * dim, "the policy has acted in other states");
    let sampled = choices.action == ActionChoice::Sample || choices.convergence == Convergence::SampledDensity;
    draw_noise(sampled, rows * dim, rng, noise);
    loss.begin(rows);
    let count = acted.shards().len();
    let shards = acted.shards().par_iter().zip(&mut parts[..count]).zip(&mut loss.d_mean[..count]);
    shards.enumerate().for_each(|(i, ((shard, part), d_mean))| {
        let range = shards::range(rows, count, i);
        let eps = if sampled { &noise[range.start * dim..range.end * dim] } else { &[] };
        part.losses(shard, batch, &batch.rows[range], eps, choices, d_mean);
    });
    let mut d_conv = 0.0;
    residual2.fill(0.0);
    for part in &parts[..count] {
        loss.value += part.loss;
        d_conv += part.agreement / rows as f64;
        shards::add_scaled(residual2, &part.residual2, 1.0 / rows as f32);
        shards::add_scaled(&mut loss.d_log_std, &part.d_log_std, 1.0);
    }
    if choices.action == ActionChoice::Mean {
        gaussian::add_nll_gradient(&batch.samples.policy.log_std, residual2, &mut loss.d_likelihood);
    }
    (loss, d_conv)
}

/// Draws so many standard normal numbers, or none.
pub fn draw_noise(wanted: bool, count: usize, rng: &mut impl Rng, noise: &mut Vec<f32>) {
    noise.clear();
    if wanted {
        noise.extend((0..count).map(|_| normal(rng) as f32));
    }
}

impl Part {
    /// The losses of `rows`, in which the shard has acted, and their gradient with respect to its mean actions.
    fn losses(&mut self, shard: &Shard, batch: Batch, rows: &[usize], noise: &[f32], choices: &Choices, d_mean: &mut Panels) {
        let policy = batch.samples.policy;
        let unit = &policy.action_scaling().std;
        let dim = unit.len();
        self.sigma.iter_mut().zip(&policy.log_std).for_each(|(sigma, log_std)| *sigma = exp_f32(*log_std));
        // L_BC = scale * sum over rows and entries of weight_i * (standardised error)^2
        let raw = choices.objective == Objective::RawSum;
        let scale = if raw { 1.0 / batch.demos as f32 } else { 1.0 / (batch.rows.len() * dim) as f32 };
        let sampled = choices.action == ActionChoice::Sample;
        (self.loss, self.agreement) = (0.0, 0.0);
        self.residual2.fill(0.0);
        self.d_log_std.fill(0.0);
        for (p, rows) in rows.chunks(LANES).enumerate() {
            batch.samples.write_targets(rows, d_mean.panel_mut(p));
        }
        d_mean.clear_tail(rows.len());
        if !noise.is_empty() {
            self.noise.grow(dim, panels_of(rows.len()));
            self.noise.write_rows(0, rows.len(), |slot| row(noise, dim, slot));
        }
        for (p, rows) in rows.chunks(LANES).enumerate() {
            let (mut loss, mut error2) = (Lanes::default(), Lanes::default());
            for (i, unit) in unit.iter().enumerate() {
                let weight = if raw { unit * unit } else { 1.0 };
                let (slot, mut mean) = (&mut d_mean.panel_mut(p)[i], shard.pass.output.panel(p)[i]);
                let label = *slot;
                if rows.len() < LANES {
                    mean.take_from(rows.len(), label); // no error where there is no row
                }
                let residual = mean - label;
                let shift = if sampled { self.noise.panel(p)[i] * self.sigma[i] } else { Lanes::default() };
                let error = residual + shift;
                let slope = error * (2.0 * scale * weight);
                loss += error * weight * error;
                error2 += residual * residual;
                self.residual2[i] += (residual * residual).sum();
                self.d_log_std[i] += (slope * shift).sum();
                *slot = slope; // the gradient where the label was
            }
            self.loss += loss.0.iter().map(|loss| f64::from(scale * loss)).sum::<f64>();
            for lane in 0..rows.len() {
                let eps = |i: usize| self.noise.panel(p)[i].0[lane];
                self.agreement += p_t(choices.convergence, choices.tau, policy, error2.0[lane], eps);
            }
        }
    }
}

/// L_BC over any number of pairs in the memory of a few, and the mean actions there (standardised, rows x A); without a gradient.
pub fn validate(batch: Batch, choices: &Choices, rng: &mut impl Rng) -> (f64, Vec<f32>) {
    let dim = batch.samples.policy.layout().action_dim();
    let (mut acted, mut work) = (Acted::default(), Workspace::new(dim, VALIDATION_ROWS));
    let (mut l_bc, mut mean) = (0.0, Vec::with_capacity(batch.rows.len() * dim));
    for rows in batch.rows.chunks(VALIDATION_ROWS) {
        let share = rows.len() as f64 / batch.rows.len() as f64;
        acted.forward(batch.samples, rows, None);
        let part = Batch { rows, demos: share * batch.demos, ..batch };
        l_bc += share * behavior_cloning(&acted, part, choices, rng, &mut work).0.value;
        mean.extend_from_slice(acted.mean());
    }
    (l_bc, mean)
}
