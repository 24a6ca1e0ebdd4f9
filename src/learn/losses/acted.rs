//! pi_theta in the states of the demos: the forward pass that behavior cloning and state cloning begin with, and the backward pass that
//! both end with.

use super::offsets::Offsets;
use super::policy_loss::Mixture;
use super::shards;
use crate::learn::models::{Policy, PolicySamples, Samples};
use crate::nn::{Lanes, Pass, panels_of};
use rayon::prelude::*;

/// The policy's mean actions in the states of one batch, in shards, with the passes that they came from.
#[derive(Default)]
pub struct Acted {
    shards: Vec<Shard>,
    active: usize,
    /// Mean actions, standardised, rows x A.
    mean: Vec<f32>,
}

/// A part of the batch.
#[derive(Default)]
pub struct Shard {
    /// The pass.
    pub pass: Pass,
    /// States.
    pub rows: usize,
    mean: Vec<f32>,
}

impl Acted {
    /// With room for batches of at most `most_rows` states.
    pub fn new(policy: &Policy, most_rows: usize) -> Self {
        let (rows, dim) = (shards::most_rows(most_rows), policy.layout().action_dim());
        let shard = || {
            let mut shard = Shard { mean: Vec::with_capacity(rows * dim), ..Shard::default() };
            shard.pass.reserve(&policy.net, panels_of(rows));
            shard
        };
        let shards = (0..shards::MAX_SHARDS).map(|_| shard()).collect();
        Acted { shards, active: 0, mean: Vec::with_capacity(most_rows * dim) }
    }

    /// pi_theta(s) of `rows`, transitions of the samples, where what it sees is off by the last draw of `offsets`.
    pub fn forward(&mut self, samples: PolicySamples, rows: &[usize], offsets: Option<&Offsets>) {
        let policy = samples.policy;
        self.active = shards::count(rows.len());
        self.shards.resize_with(self.active.max(self.shards.len()), Shard::default);
        let active = self.active;
        self.shards[..active].par_iter_mut().enumerate().for_each(|(i, shard)| {
            let part = shards::range(rows.len(), active, i);
            let panels = panels_of(part.len());
            shard.rows = part.len();
            shard.pass.grow(&policy.net, panels);
            samples.write_inputs(&rows[part.clone()], &mut shard.pass.input);
            offsets.inspect(|offsets| offsets.add(part, &mut shard.pass.input));
            policy.net.forward(&mut shard.pass, 0..panels);
            shard.mean.clear();
            shard.mean.resize(shard.rows * policy.action_scaling().width(), 0.0);
            shard.pass.output.read_rows(&mut shard.mean);
        });
        self.mean.clear();
        self.shards[..active].iter().for_each(|shard| self.mean.extend_from_slice(&shard.mean));
    }

    /// The parts of the last batch.
    pub fn shards(&self) -> &[Shard] {
        &self.shards[..self.active]
    }

    /// Mean actions of the last batch, standardised, rows x A.
    pub fn mean(&self) -> &[f32] {
        &self.mean
    }

    /// gradient = grad_theta of a mixture of losses over the last batch, under the policy that it was made with.
    pub fn gradient(&mut self, policy: &Policy, of: Mixture, gradient: &mut [f32]) {
        self.shards[..self.active].par_iter_mut().enumerate().for_each(|(i, shard)| {
            let panels = 0..panels_of(shard.rows);
            let d_output = shard.pass.d_output.span_mut(&panels);
            d_output.fill(Lanes::default());
            for (weight, loss) in of.terms() {
                let weight = weight as f32;
                d_output.iter_mut().zip(loss.d_mean[i].span(&panels)).for_each(|(sum, d)| *sum += *d * weight);
            }
            policy.net.begin_gradient(&mut shard.pass);
            policy.net.learn(&mut shard.pass, panels);
        });
        policy.net.finish_gradient(self.shards[..self.active].iter_mut().map(|shard| &mut shard.pass), gradient);
        for (weight, loss) in of.terms() {
            shards::add_scaled(gradient, &loss.d_params, weight as f32);
        }
    }
}
