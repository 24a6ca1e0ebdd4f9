//! Algorithm 2: behavior cloning. L_BC (Eq. 3) and the degree of policy convergence d_conv (Eq. 4) over the states of the demos.

use super::corpus::row;
use super::policy::Policy;
use super::samples::{PolicySamples, Samples};
use super::shards;
use crate::config::{ActionChoice, Convergence, Objective, TrainSettings};
use crate::math::exp_f32;
use crate::nn::{BLOCK_PANELS, LANES, Lanes, Panels, Pass, gaussian, panels_of};
use crate::seed::normal;
use crate::state::JOINTS;
use rand::Rng;
use rayon::prelude::*;

/// What Algorithm 2 returns.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cloned {
    /// L_BC, Eq. 3.
    pub l_bc: f64,
    /// d_conv, Eq. 4.
    pub d_conv: f64,
}

/// The state-action pairs of one update.
#[derive(Clone, Copy)]
pub struct Batch<'a> {
    /// The corpus' policy samples.
    pub samples: &'a PolicySamples<'a>,
    /// Transitions of the corpus.
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

/// The workspace: one pass a shard.
#[derive(Default)]
pub struct Workspace {
    shards: Vec<Shard>,
    active: usize,
    noise: Vec<f32>,
    /// Mean actions of the batch, standardised, rows x 9.
    pub mean: Vec<f32>,
    /// Gradient of L_BC with respect to the log standard deviations.
    pub d_log_std: [f32; JOINTS],
}

#[derive(Default)]
struct Shard {
    pass: Pass,
    rows: usize,
    /// Mean actions, rows x 9.
    mean: Vec<f32>,
    /// Gradient of L_BC with respect to the mean actions, standardised.
    d_bc: Panels,
    noise: Panels,
    loss: f64,
    agreement: f64,
    residual2: [f32; JOINTS],
    d_log_std: [f32; JOINTS],
}

/// Algorithm 2 over a batch. `rng` draws the samples a_t ~ pi_theta(s_t^E) where the settings ask for them; p_t always comes from the
/// mean unless it is the sampled density. The gradient with respect to the mean actions stays in `work` for [`policy_gradient`].
pub fn behavior_cloning(policy: &Policy, batch: Batch, choices: &Choices, rng: &mut impl Rng, work: &mut Workspace) -> Cloned {
    in_blocks(policy, batch, choices, rng, work, usize::MAX)
}

/// As [`behavior_cloning`], of any number of rows in the memory of a few: nothing stays for [`policy_gradient`].
pub fn validate(policy: &Policy, batch: Batch, choices: &Choices, rng: &mut impl Rng, work: &mut Workspace) -> Cloned {
    in_blocks(policy, batch, choices, rng, work, BLOCK_PANELS * LANES)
}

fn in_blocks(
    policy: &Policy,
    batch: Batch,
    choices: &Choices,
    rng: &mut impl Rng,
    work: &mut Workspace,
    block_rows: usize,
) -> Cloned {
    let rows = batch.rows.len();
    let samples = choices.action == ActionChoice::Sample || choices.convergence == Convergence::SampledDensity;
    draw_noise(samples, rows, rng, &mut work.noise);
    work.active = shards::count(rows);
    work.shards.resize_with(work.active.max(work.shards.len()), Shard::default);
    let noise = &work.noise;
    work.shards[..work.active].par_iter_mut().enumerate().for_each(|(i, shard)| {
        let part = shards::range(rows, shards::count(rows), i);
        shard.begin(policy, part.len(), block_rows);
        for from in part.clone().step_by(block_rows) {
            let block = from..part.end.min(from.saturating_add(block_rows));
            batch.samples.write_inputs(&batch.rows[block.clone()], &mut shard.pass.input);
            policy.net.forward(&mut shard.pass, 0..panels_of(block.len()));
            let eps = if samples { &noise[block.start * JOINTS..block.end * JOINTS] } else { &[] };
            shard.losses(policy, batch, &batch.rows[block], eps, choices);
        }
    });
    work.collect(policy, rows, choices.action)
}

/// Draws rows x 9 standard normal numbers, or none.
pub fn draw_noise(wanted: bool, rows: usize, rng: &mut impl Rng, noise: &mut Vec<f32>) {
    noise.clear();
    if wanted {
        noise.extend((0..rows * JOINTS).map(|_| normal(rng) as f32));
    }
}

impl Workspace {
    /// With room for batches of at most `most_rows` state-action pairs.
    pub fn new(policy: &Policy, most_rows: usize) -> Self {
        let rows = shards::most_rows(most_rows);
        let shard = || {
            let mut shard = Shard { mean: Vec::with_capacity(rows * JOINTS), ..Shard::default() };
            shard.pass.provide(&policy.net, panels_of(rows));
            [&mut shard.d_bc, &mut shard.noise].into_iter().for_each(|array| array.provide(JOINTS, panels_of(rows)));
            shard
        };
        Workspace {
            shards: (0..shards::MAX_SHARDS).map(|_| shard()).collect(),
            noise: Vec::with_capacity(most_rows * JOINTS),
            mean: Vec::with_capacity(most_rows * JOINTS),
            ..Workspace::default()
        }
    }
}

impl Shard {
    /// Nothing is known of the `rows` that come, at most `block_rows` at once.
    fn begin(&mut self, policy: &Policy, rows: usize, block_rows: usize) {
        self.pass.reserve(&policy.net, panels_of(rows.min(block_rows)));
        (self.rows, self.loss, self.agreement) = (rows, 0.0, 0.0);
        (self.residual2, self.d_log_std) = ([0.0; JOINTS], [0.0; JOINTS]);
        self.mean.clear();
    }

    /// Adds the losses of `rows`, whose actions the last pass has.
    fn losses(&mut self, policy: &Policy, batch: Batch, rows: &[usize], noise: &[f32], choices: &Choices) {
        let unit = &policy.action_scaling().std;
        let sigma: [f32; JOINTS] = std::array::from_fn(|i| exp_f32(policy.log_std[i]));
        // L_BC = scale * sum over rows and entries of weight_i * (standardised error)^2
        let (weight, scale): ([f32; JOINTS], f32) = match choices.objective {
            Objective::RawSum => (std::array::from_fn(|i| unit[i] * unit[i]), 1.0 / batch.demos as f32),
            Objective::StandardisedMean => ([1.0; JOINTS], 1.0 / (batch.rows.len() * JOINTS) as f32),
        };
        let sampled = choices.action == ActionChoice::Sample;
        let panels = panels_of(rows.len());
        let known = self.mean.len();
        self.mean.resize(known + rows.len() * JOINTS, 0.0);
        self.pass.output.read_rows(&mut self.mean[known..]);
        self.d_bc.reserve(JOINTS, panels);
        for (p, rows) in rows.chunks(LANES).enumerate() {
            batch.samples.write_targets(rows, self.d_bc.panel_mut(p));
        }
        self.d_bc.clear_tail(rows.len());
        if !noise.is_empty() {
            self.noise.reserve(JOINTS, panels);
            self.noise.write_rows(0, rows.len(), |slot| row(noise, JOINTS, slot));
        }
        for (p, rows) in rows.chunks(LANES).enumerate() {
            let (mut loss, mut error2) = (Lanes::default(), Lanes::default());
            for i in 0..JOINTS {
                let (label, mut mean) = (&mut self.d_bc.panel_mut(p)[i], self.pass.output.panel(p)[i]);
                if rows.len() < LANES {
                    mean.take_from(rows.len(), *label); // no error where there is no row
                }
                let residual = mean - *label;
                let shift = if sampled { self.noise.panel(p)[i] * sigma[i] } else { Lanes::default() };
                let error = residual + shift;
                let slope = error * (2.0 * scale * weight[i]);
                loss += error * weight[i] * error;
                error2 += residual * residual;
                self.residual2[i] += (residual * residual).sum();
                self.d_log_std[i] += (slope * shift).sum();
                *label = slope;
            }
            self.loss += loss.0.iter().map(|loss| f64::from(scale * loss)).sum::<f64>();
            for lane in 0..rows.len() {
                self.agreement += match choices.convergence {
                    Convergence::SampledDensity => {
                        let eps: [f32; JOINTS] = std::array::from_fn(|i| self.noise.panel(p)[i].0[lane]);
                        gaussian::sample_density(&policy.log_std, unit, &eps)
                    }
                    Convergence::Agreement => {
                        f64::from(exp_f32(-0.5 * error2.0[lane] / (JOINTS as f32 * choices.tau * choices.tau)))
                    }
                };
            }
        }
    }
}

impl Workspace {
    fn collect(&mut self, policy: &Policy, rows: usize, action: ActionChoice) -> Cloned {
        let (mut cloned, mut residual2) = (Cloned::default(), [0.0f32; JOINTS]);
        self.mean.clear();
        self.d_log_std = [0.0; JOINTS];
        for shard in &self.shards[..self.active] {
            cloned.l_bc += shard.loss;
            cloned.d_conv += shard.agreement / rows as f64;
            shards::add_scaled(&mut residual2, &shard.residual2, 1.0 / rows as f32);
            shards::add_scaled(&mut self.d_log_std, &shard.d_log_std, 1.0);
            self.mean.extend_from_slice(&shard.mean);
        }
        if action == ActionChoice::Mean {
            gaussian::add_nll_gradient(&policy.log_std, &residual2, &mut self.d_log_std);
        }
        cloned
    }
}

/// gradient = grad_theta of bc_weight * L_BC + first_weight * (sum over rows of d_first . mu), by one backward pass over the batch of
/// the last [`behavior_cloning`]. `d_first` (rows x 9, or empty) is what state cloning sends back to the mean actions in the demos'
/// own states.
pub fn policy_gradient(
    policy: &Policy,
    (bc_weight, first_weight): (f32, f32),
    d_first: &[f32],
    work: &mut Workspace,
    gradient: &mut [f32],
) {
    let mut from = 0;
    let parts = work.shards[..work.active].iter_mut().map(|shard| {
        let start = from;
        from += shard.rows * JOINTS;
        (shard, d_first.get(start..from))
    });
    let mut parts: [Option<_>; shards::MAX_SHARDS] = collect_array(parts);
    parts.par_iter_mut().flatten().for_each(|(shard, d_first)| {
        let (rows, d_output) = (shard.rows, &mut shard.pass.d_output);
        let panels = 0..panels_of(rows);
        match d_first {
            Some(d_first) => d_output.write_rows(0, rows, |slot| row(d_first, JOINTS, slot)),
            None => d_output.span_mut(&panels).fill(Lanes::default()),
        }
        for (slot, bc) in d_output.span_mut(&panels).iter_mut().zip(shard.d_bc.span(&panels)) {
            *slot = *bc * bc_weight + *slot * first_weight;
        }
        policy.net.begin_gradient(&mut shard.pass);
        policy.net.learn(&mut shard.pass, 0..panels_of(rows));
    });
    policy.net.finish_gradient(work.shards[..work.active].iter_mut().map(|shard| &mut shard.pass), gradient);
}

fn collect_array<T, const N: usize>(items: impl Iterator<Item = T>) -> [Option<T>; N] {
    let mut array = std::array::from_fn(|_| None);
    array.iter_mut().zip(items).for_each(|(slot, item)| *slot = Some(item));
    array
}
