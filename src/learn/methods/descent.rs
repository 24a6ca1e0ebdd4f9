//! Eq. 2: theta <- theta - grad L_mix, by Adam, with an average of theta beside it.

use super::optimizer::{Optimizer, Steps};
use crate::config::TrainSettings;
use crate::learn::losses::{Acted, Mixture};
use crate::learn::models::{Policy, Reader, vector};
use crate::math::ln;
use crate::nn::{clip_by_global_norm, gaussian, global_norm};
use crate::tensor::NamedTensor;
use serde::{Deserialize, Serialize};

/// Norm of a gradient above which Adam's second moment, a square, would not fit into an f32.
const LARGEST_NORM: f64 = 1e19;

/// What the names of the saved arrays begin with.
const NET: &str = "policy.net";
const STD: &str = "policy.log_std";

/// A policy on its way down.
pub struct Descent {
    /// pi_theta.
    pub policy: Policy,
    /// The same with averaged weights, as of the last [`Descent::update_averaged`].
    pub averaged: Policy,
    /// Updates of the present stage.
    pub updates: u64,
    /// Updates left out in all stages, because a gradient was not finite.
    pub skipped: u64,
    /// The loss whose gradient made the last update be left out.
    pub left_out: &'static str,
    net: Optimizer,
    std: Optimizer,
    gradient: Vec<f32>,
    d_log_std: Vec<f32>,
    /// Largest norm of the gradient; 0 = no limit.
    clip_norm: f64,
    log_std_floor: f32,
    ema_decay: f64,
}

/// What of a [`Descent`] is no array.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Counts {
    updates: u64,
    skipped: u64,
    net: Steps,
    std: Steps,
}

impl Descent {
    /// A policy at its beginning.
    pub fn new(policy: Policy, settings: &TrainSettings) -> Self {
        Descent {
            updates: 0,
            skipped: 0,
            left_out: "",
            net: Optimizer::new(policy.net.params(), settings.ema_decay),
            std: Optimizer::new(&policy.log_std, settings.ema_decay),
            gradient: vec![0.0; policy.net.params().len()],
            d_log_std: vec![0.0; policy.log_std.len()],
            clip_norm: settings.clip_norm,
            log_std_floor: ln(settings.std_floor) as f32,
            ema_decay: settings.ema_decay,
            averaged: policy.clone(),
            policy,
        }
    }

    /// Fresh optimisers; the average starts at the present weights.
    pub fn begin_stage(&mut self) {
        self.updates = 0;
        self.net = Optimizer::new(self.policy.net.params(), self.ema_decay);
        self.std = Optimizer::new(&self.policy.log_std, self.ema_decay);
    }

    /// The averaged weights become the weights.
    pub fn end_stage(&mut self) {
        self.policy.net.params_mut().copy_from_slice(self.net.averaged());
        self.policy.log_std.copy_from_slice(self.std.averaged());
    }

    /// Brings the policy with the averaged weights up to date.
    pub fn update_averaged(&mut self) {
        self.averaged.net.params_mut().copy_from_slice(self.net.averaged());
        self.averaged.log_std.copy_from_slice(self.std.averaged());
    }

    /// Norm of the gradient of a mixture of losses over the batch of `acted`.
    pub fn gradient_norm(&mut self, acted: &mut Acted, of: Mixture) -> f64 {
        acted.gradient(&self.policy, of, &mut self.gradient);
        global_norm(&self.gradient)
    }

    /// theta <- theta - grad L_mix. An update whose gradient is not finite (long rollouts without recovery) is left out.
    pub fn update(&mut self, acted: &mut Acted, l_mix: Mixture, learning_rate: f64) {
        self.updates += 1;
        acted.gradient(&self.policy, l_mix, &mut self.gradient);
        let norm = clip_by_global_norm(&mut self.gradient, self.clip_norm);
        l_mix.d_log_std(&mut self.d_log_std);
        let too_long = self.clip_norm == 0.0 && norm > LARGEST_NORM;
        if !norm.is_finite() || too_long || !usable(&self.d_log_std) {
            self.skipped += 1;
            self.left_out = self.unusable(acted, l_mix);
            return;
        }
        self.net.step(&mut self.policy.net.params_mut(), &self.gradient, learning_rate);
        self.net.average(self.policy.net.params());
        self.std.step(&mut self.policy.log_std, &self.d_log_std, learning_rate);
        gaussian::floor_log_std(&mut self.policy.log_std, self.log_std_floor);
        self.std.average(&self.policy.log_std);
    }

    /// The loss whose gradient is no use.
    fn unusable(&mut self, acted: &mut Acted, l_mix: Mixture) -> &'static str {
        let mut unusable = |alone: Mixture| {
            alone.d_log_std(&mut self.d_log_std);
            !(self.gradient_norm(acted, alone) <= LARGEST_NORM && usable(&self.d_log_std))
        };
        let culprit = l_mix.terms().find(|(_, loss)| unusable(1.0 * *loss)).or_else(|| l_mix.terms().last());
        culprit.map_or("", |(_, loss)| loss.name)
    }

    /// All that changes from update to update.
    pub fn save(&self, out: &mut Vec<NamedTensor>) -> Counts {
        out.extend([vector(NET, self.policy.net.params()), vector(STD, &self.policy.log_std)]);
        self.net.push(out, NET);
        self.std.push(out, STD);
        Counts { updates: self.updates, skipped: self.skipped, net: self.net.steps(), std: self.std.steps() }
    }

    /// The inverse of [`Descent::save`]; the last epoch stood at `updates` and `skipped`.
    ///
    /// # Errors
    /// Says what is missing, does not fit or cannot be.
    pub fn restore(&mut self, reader: &Reader, counts: &Counts, (updates, skipped): (u64, u64)) -> Result<(), String> {
        if (counts.updates, counts.skipped) != (updates, skipped) {
            let (ours, left_out) = (counts.updates, counts.skipped);
            return Err(format!("it counts {ours} updates and {left_out} left out, its last epoch {updates} and {skipped}"));
        }
        let (net, std) = (self.policy.net.params().len(), self.policy.log_std.len());
        self.policy.net.params_mut().copy_from_slice(&reader.tensor(NET, &[net])?);
        self.policy.log_std = reader.log_std(STD, self.policy.log_std.len())?;
        self.net = Optimizer::restore(reader, NET, net, self.ema_decay, counts.net)?;
        self.std = Optimizer::restore(reader, STD, std, self.ema_decay, counts.std)?;
        (self.updates, self.skipped) = (counts.updates, counts.skipped);
        self.update_averaged();
        Ok(())
    }
}

fn usable(d_log_std: &[f32]) -> bool {
    d_log_std.iter().all(|d| f64::from(d.abs()) <= LARGEST_NORM)
}
