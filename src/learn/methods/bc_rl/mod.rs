//! Behavior cloning and reinforcement learning together, which the paper compares with (its references 17 and 18): behavior cloning
//! first, then L_RL + lambda L_BC, as in DAPG (Rajeswaran et al. 2018, *Learning Complex Dexterous Manipulation with Deep Reinforcement
//! Learning and Demonstrations*).
//!
//! The cloning is [`Hil`] with alpha = 0, the method `bc`. L_RL is [`Ppo`]'s clipped objective on the steps of an iteration; L_BC (Eq. 3)
//! is that of the other methods, on state-action pairs of the demos drawn at random for each update. lambda decays with the iterations,
//! so that the demos lead at first and the rewards decide at the end. In the first iterations only the value network learns: it knows
//! nothing of the cloned policy, and the advantages of a value network that knows nothing would teach the policy noise. The standard
//! deviation of the actions is L_RL's alone.

mod demos;
mod stages;
#[cfg(test)]
mod tests;

use super::hil::Hil;
use super::inputs::Inputs;
use super::ppo::{Lesson, Ppo};
use crate::config::{Alpha, BcRlSettings, PpoSettings, TrainSettings};
use crate::env::Env;
use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::learn::run::{EpochMetrics, Mean, Stage};
use crate::math::pow;
use crate::seed::stream;
use demos::Demos;

/// The stage after those of behavior cloning.
pub const BC_RL: &str = "bc-rl";

/// Behavior cloning, then reinforcement learning with L_BC, between two epochs.
pub struct BcRl {
    settings: BcRlSettings,
    seed: u64,
    cloning: Hil,
    demos: Demos,
    ppo: Ppo,
    /// Whether the cloning is over.
    by_rewards: bool,
}

impl BcRl {
    /// A fresh policy for these demos, and worlds; `make` gives one whose episodes are cut off after so many steps.
    ///
    /// # Errors
    /// As [`Hil::new`] and [`Ppo::new`].
    pub fn new(inputs: Inputs, settings: &TrainSettings, seed: u64, make: impl Fn(u32) -> Result<Box<dyn Env>>) -> Result<Self> {
        let cloning = Hil::new(inputs, None, Alpha::Fixed(0.0), settings, seed)?;
        let rate = settings.bc_rl.learning_rate;
        let ppo = PpoSettings { learning_rate: rate, final_learning_rate: rate, ..settings.ppo.clone() };
        let demos = Demos::new(settings, cloning.policy().layout());
        let ppo = Ppo::going_on(cloning.policy().clone(), &TrainSettings { ppo, ..settings.clone() }, seed, make)?;
        Ok(BcRl { settings: settings.bc_rl.clone(), seed, demos, cloning, ppo, by_rewards: false })
    }

    /// lambda in an iteration, and none as long as only the value network learns.
    fn lambda(&self, iteration: u64) -> Option<f64> {
        let past = iteration.checked_sub(self.settings.value_iterations)?;
        Some(self.settings.lambda * pow(self.settings.lambda_decay, past as f64))
    }

    /// An iteration on L_RL + lambda L_BC.
    fn iteration(&mut self, stage: Stage, iteration: u64, interrupt: &Interrupt) -> Result<EpochMetrics> {
        let Some(lambda) = self.lambda(iteration) else {
            return self.ppo.report(stage, iteration, interrupt, &mut Lesson::Value);
        };
        let (demos, corpus, mut l_bc) = (&mut self.demos, self.cloning.demos(), Mean::default());
        let mut rng = stream(self.seed, "train.bc-rl", iteration);
        let mut add_l_bc = |policy: &_, gradient: &mut [f32]| {
            l_bc.add(demos.add_gradient(policy, corpus, lambda, &mut rng, gradient)?);
            Ok(())
        };
        let mut row = self.ppo.report(stage, iteration, interrupt, &mut Lesson::Both(Some(&mut add_l_bc)))?;
        row.set("l_bc", l_bc.get());
        row.set("lambda", lambda);
        Ok(row)
    }
}
