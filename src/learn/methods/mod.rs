//! One file a method, and what methods share.

pub mod batches;
pub mod bc_rl;
mod cost;
pub mod descent;
pub mod fine_tuning;
pub mod hil;
mod inputs;
pub mod mixing;
mod optimizer;
mod patience;
pub mod ppo;
pub mod pretrain_dynamics;
mod validation;

pub use bc_rl::BcRl;
pub use hil::{Hil, Update};
pub use inputs::Inputs;
pub use ppo::Ppo;
pub use pretrain_dynamics::pretrain_dynamics;

use crate::config::{Alpha, TrainSettings};
use crate::error::{Error, Result};
use crate::learn::models::Dynamics;
use crate::learn::run::{Hooks, Method, Trained, run};
use crate::words::{did_you_mean, shown};
use std::str::FromStr;

/// The methods by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum MethodName {
    /// Algorithm 1: both losses, mixed by alpha as the settings say.
    Hil,
    /// Algorithm 2 alone: Algorithm 1 with alpha = 0.
    Bc,
    /// Algorithm 3 alone: Algorithm 1 with alpha = 1, and no warm start.
    Sc,
    /// Proximal policy optimisation: no demos, but the simulator.
    Ppo,
    /// Behavior cloning, then proximal policy optimisation with its loss: demos and the simulator.
    BcRl,
}

impl MethodName {
    /// All of them.
    pub const ALL: [MethodName; 5] = [MethodName::Hil, MethodName::Bc, MethodName::Sc, MethodName::Ppo, MethodName::BcRl];

    /// As `hilt train --method` takes it.
    pub fn name(self) -> &'static str {
        ["hil", "bc", "sc", "ppo", "bc-rl"][self as usize]
    }

    /// The settings that it trains with. State cloning has features of its own, and no warm start, which is behavior cloning; it may use as
    /// many updates as that on so many `transitions`, and its learning rate.
    pub fn own_settings(self, settings: &TrainSettings, transitions: usize) -> TrainSettings {
        let mut own = settings.clone();
        let warm_start = settings.warm_start(transitions);
        if self != MethodName::Sc {
            return own;
        }
        own.features = settings.sc.features;
        if warm_start > 0 {
            own.warm_start_updates = 0.into();
            own.min_updates = settings.min_updates.max(warm_start);
            own.learning_rate = settings.warm_start_learning_rate;
        }
        own
    }

    /// Whether it learns through a dynamics network.
    pub fn needs_dynamics(self) -> bool {
        matches!(self, MethodName::Hil | MethodName::Sc)
    }

    /// Whether it learns from demos.
    pub fn needs_demos(self) -> bool {
        self != MethodName::Ppo
    }

    /// alpha of Eq. 1, for what Algorithm 1 covers.
    fn alpha(self, settings: &TrainSettings) -> Option<Alpha> {
        match self {
            MethodName::Hil => Some(settings.alpha),
            MethodName::Bc => Some(Alpha::Fixed(0.0)),
            MethodName::Sc => Some(Alpha::Fixed(1.0)),
            MethodName::Ppo | MethodName::BcRl => None,
        }
    }
}

impl FromStr for MethodName {
    type Err = String;

    fn from_str(s: &str) -> std::result::Result<Self, String> {
        MethodName::ALL.into_iter().find(|method| method.name() == s).ok_or_else(|| {
            let hint = did_you_mean(s, MethodName::ALL.map(MethodName::name));
            let s = shown(s);
            format!(
                "unknown method \"{s}\"{hint}; allowed: hil (both losses), bc (behavior cloning), sc (state cloning), ppo (from rewards), \
                 bc-rl (behavior cloning, then rewards)"
            )
        })
    }
}

/// A method that learns from demos alone, before its first epoch.
///
/// # Errors
/// [`Error::Usage`] for a setting out of range, a missing dynamics network, or a method that needs the simulator; [`Error::Failed`] for a
/// dynamics network of another task.
pub fn imitator(
    method: MethodName,
    inputs: Inputs,
    dynamics: Option<Dynamics>,
    settings: &TrainSettings,
    seed: u64,
) -> Result<Box<dyn Method>> {
    settings.validate()?;
    let Some(alpha) = method.alpha(settings) else {
        return Err(Error::Usage(format!("{} learns in the simulator, not from demos alone", method.name())));
    };
    let own = method.own_settings(settings, inputs.train.rows());
    Ok(Box::new(Hil::new(inputs, dynamics, alpha, &own, seed)?))
}

/// Trains a policy on demos. A run that goes on from a checkpoint of the same run ends with the same bits.
///
/// # Errors
/// As [`imitator`]; [`Error::Failed`] for a checkpoint that does not fit, or when a loss is not a number; [`Error::Interrupted`]; what
/// rollouts return.
pub fn train(
    method: MethodName,
    inputs: Inputs,
    dynamics: Option<Dynamics>,
    settings: &TrainSettings,
    seed: u64,
    hooks: Hooks,
) -> Result<Trained> {
    run(imitator(method, inputs, dynamics, settings, seed)?, settings, hooks)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{FeatureSet, ScSettings};

    #[test]
    fn state_cloning_alone_sees_what_its_own_key_says_and_learns_as_long_as_a_warm_start() {
        let sc = ScSettings { features: FeatureSet::FkNear, ..Default::default() };
        let settings = TrainSettings { features: FeatureSet::Fk, sc, min_updates: 10, ..Default::default() };
        let own = MethodName::Sc.own_settings(&settings, 50_000);
        assert_eq!((own.features, own.warm_start_updates), (FeatureSet::FkNear, 0.into()));
        assert_eq!((own.min_updates, own.learning_rate), (37_240, settings.warm_start_learning_rate));
        for method in [MethodName::Hil, MethodName::Bc, MethodName::Ppo, MethodName::BcRl] {
            assert_eq!(method.own_settings(&settings, 50_000), settings);
        }
    }
}
