//! The clipped objective (Schulman et al. 2017) and the loss of the value network over some panels of steps, with their gradients.

use super::group::Record;
use crate::learn::losses::shards;
use crate::learn::models::Policy;
use crate::math::exp_f32;
use crate::nn::{LANES, Lanes, Mlp, Pass};
use rayon::prelude::*;

/// The keys that shape the objective.
#[derive(Clone, Copy, Debug)]
pub struct Choices {
    /// How far a ratio of probabilities may move from 1.
    pub clip: f32,
    /// Weight of the entropy.
    pub entropy: f32,
}

/// What an update sees: means over its steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seen {
    /// Minus the clipped objective, without the entropy.
    pub policy_loss: f64,
    /// Half the mean square error of the values, in their units.
    pub value_loss: f64,
    /// Divergence of the policy from that which acted: mean of r - 1 - ln r.
    pub kl: f64,
    /// Share of steps whose ratio was beyond the clip.
    pub clipped: f64,
}

/// The workspace, and the gradients of the last [`Work::look`].
#[derive(Default)]
pub struct Work {
    shards: Vec<Shard>,
    /// Gradient for the policy's network.
    pub d_policy: Vec<f32>,
    /// Gradient for the logarithms of the standard deviations.
    pub d_log_std: Vec<f32>,
    /// Gradient for the value network.
    pub d_value: Vec<f32>,
}

#[derive(Default)]
struct Shard {
    policy: Pass,
    value: Pass,
    seen: Seen,
    d_log_std: Vec<f32>,
    precision: Vec<f32>,
    /// (action - mean) / sigma in the panel at hand.
    z: Vec<Lanes>,
}

impl Work {
    /// Losses over these panels, each a group and a step, and their gradients.
    pub fn look(
        &mut self,
        policy: &Policy,
        value: &Mlp,
        records: &[Record],
        panels: &[(usize, usize)],
        choices: Choices,
    ) -> Seen {
        let rows = panels.len() * LANES;
        let count = shards::count(rows).min(panels.len());
        self.shards.resize_with(count.max(self.shards.len()), Shard::default);
        self.shards[..count].par_iter_mut().enumerate().for_each(|(i, shard)| {
            let part = &panels[shards::range(panels.len(), count, i)];
            shard.forward(policy, value, records, part);
            shard.losses(policy, records, part, rows, choices);
            for (net, pass) in [(&policy.net, &mut shard.policy), (value, &mut shard.value)] {
                net.begin_gradient(pass);
                net.learn(pass, 0..part.len());
            }
        });
        self.collect(policy, value, count, choices)
    }

    fn collect(&mut self, policy: &Policy, value: &Mlp, count: usize, choices: Choices) -> Seen {
        let mut seen = Seen::default();
        self.d_log_std.clear();
        self.d_log_std.resize(policy.log_std.len(), -choices.entropy);
        for shard in &self.shards[..count] {
            seen.policy_loss += shard.seen.policy_loss;
            seen.value_loss += shard.seen.value_loss;
            seen.kl += shard.seen.kl;
            seen.clipped += shard.seen.clipped;
            shards::add_scaled(&mut self.d_log_std, &shard.d_log_std, 1.0);
        }
        self.d_policy.resize(policy.net.params().len(), 0.0);
        self.d_value.resize(value.params().len(), 0.0);
        let active = &mut self.shards[..count];
        policy.net.finish_gradient(active.iter_mut().map(|shard| &mut shard.policy), &mut self.d_policy);
        value.finish_gradient(active.iter_mut().map(|shard| &mut shard.value), &mut self.d_value);
        seen
    }
}

impl Shard {
    fn forward(&mut self, policy: &Policy, value: &Mlp, records: &[Record], panels: &[(usize, usize)]) {
        for (net, pass) in [(&policy.net, &mut self.policy), (value, &mut self.value)] {
            pass.grow(net, panels.len());
            for (p, (group, step)) in panels.iter().enumerate() {
                pass.input.panel_mut(p).copy_from_slice(records[*group].inputs.panel(*step));
            }
            net.forward(pass, 0..panels.len());
        }
    }

    /// Losses of the panels, out of `rows` in all shards, and the gradients with respect to the networks' outputs.
    fn losses(&mut self, policy: &Policy, records: &[Record], panels: &[(usize, usize)], rows: usize, choices: Choices) {
        let share = 1.0 / rows as f32;
        self.precision.clear();
        self.precision.extend(policy.log_std.iter().map(|log_std| exp_f32(-log_std)));
        let log_sigma: f32 = policy.log_std.iter().sum();
        self.seen = Seen::default();
        self.d_log_std.clear();
        self.d_log_std.resize(policy.log_std.len(), 0.0);
        for (p, (group, step)) in panels.iter().enumerate() {
            let (record, step) = (&records[*group], *step);
            let (mean, action) = (self.policy.output.panel(p), record.actions.panel(step));
            self.z.clear();
            self.z.extend(
                action.iter().zip(mean).zip(&self.precision).map(|((action, mean), precision)| (*action - *mean) * *precision),
            );
            let squares = self.z.iter().fold(Lanes::default(), |sum, z| sum + *z * *z);
            let log_ratio = squares * -0.5 - Lanes::splat(log_sigma) - record.log_prob[step];
            let ratio = log_ratio.map(exp_f32);
            // The slope of minus the objective with respect to the logarithm of the probability.
            let slope = self.objective(ratio, log_ratio, record.advantages[step], share, choices.clip);
            for (i, d) in self.policy.d_output.panel_mut(p).iter_mut().enumerate() {
                let z = self.z[i];
                *d = slope * z * self.precision[i];
                self.d_log_std[i] += (slope * (z * z - Lanes::splat(1.0))).sum();
            }
            let error = self.value.output.panel(p)[0] - record.returns[step];
            self.value.d_output.panel_mut(p)[0] = error * share;
            self.seen.value_loss += f64::from((error * error).sum() * 0.5 * share);
        }
    }

    fn objective(&mut self, ratio: Lanes, log_ratio: Lanes, advantage: Lanes, share: f32, clip: f32) -> Lanes {
        let mut slope = Lanes::default();
        for lane in 0..LANES {
            let (r, a) = (ratio.0[lane], advantage.0[lane]);
            let (free, held) = (r * a, r.clamp(1.0 - clip, 1.0 + clip) * a);
            self.seen.policy_loss -= f64::from(share * free.min(held));
            self.seen.kl += f64::from(share * (r - 1.0 - log_ratio.0[lane]));
            self.seen.clipped += if (r - 1.0).abs() > clip { f64::from(share) } else { 0.0 };
            slope.0[lane] = if free <= held { -share * free } else { 0.0 };
        }
        slope
    }
}
