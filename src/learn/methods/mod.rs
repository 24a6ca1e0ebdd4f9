//! One file a method, and what methods share.

mod batches;
mod cost;
pub mod descent;
pub mod fine_tuning;
pub mod hil;
mod hil_metrics;
mod inputs;
pub mod mixing;
mod optimizer;
mod patience;
pub mod pretrain_dynamics;
mod validation;

pub use hil::{Hil, Update};
pub use inputs::Inputs;
pub use pretrain_dynamics::pretrain_dynamics;

use crate::config::{Alpha, TrainSettings};
use crate::error::Result;
use crate::learn::models::Dynamics;
use crate::learn::run::{Hooks, Trained, run};
use crate::words::{did_you_mean, shown};
use std::str::FromStr;

/// The methods by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MethodName {
    /// Algorithm 1: both losses, mixed by alpha as the settings say.
    Hil,
    /// Algorithm 2 alone: Algorithm 1 with alpha = 0.
    Bc,
    /// Algorithm 3 alone: Algorithm 1 with alpha = 1, and no warm start.
    Sc,
}

impl MethodName {
    /// All of them.
    pub const ALL: [MethodName; 3] = [MethodName::Hil, MethodName::Bc, MethodName::Sc];

    /// As `hilt train --method` takes it.
    pub fn name(self) -> &'static str {
        ["hil", "bc", "sc"][self as usize]
    }

    /// Whether it learns through a dynamics network.
    pub fn needs_dynamics(self) -> bool {
        self != MethodName::Bc
    }

    /// alpha of Eq. 1.
    fn alpha(self, settings: &TrainSettings) -> Alpha {
        match self {
            MethodName::Hil => settings.alpha,
            MethodName::Bc => Alpha::Fixed(0.0),
            MethodName::Sc => Alpha::Fixed(1.0),
        }
    }
}

impl FromStr for MethodName {
    type Err = String;

    fn from_str(s: &str) -> std::result::Result<Self, String> {
        MethodName::ALL.into_iter().find(|method| method.name() == s).ok_or_else(|| {
            let hint = did_you_mean(s, MethodName::ALL.map(MethodName::name));
            let s = shown(s);
            format!("unknown method \"{s}\"{hint}; allowed: hil (both losses), bc (behavior cloning), sc (state cloning)")
        })
    }
}

/// Trains a policy on demos. A run that goes on from a checkpoint of the same run ends with the same bits.
///
/// # Errors
/// [`crate::error::Error::Usage`] for a setting out of range or a missing dynamics network; [`crate::error::Error::Failed`] without
/// demos, for a dynamics network of another task, a checkpoint that does not fit, or when a loss is not a number;
/// [`crate::error::Error::Interrupted`]; what rollouts return.
pub fn train(
    method: MethodName,
    inputs: Inputs,
    dynamics: Option<Dynamics>,
    settings: &TrainSettings,
    seed: u64,
    hooks: Hooks,
) -> Result<Trained> {
    settings.validate()?;
    let from_scratch = TrainSettings { warm_start_updates: 0, ..settings.clone() };
    let settings = if method == MethodName::Sc { &from_scratch } else { settings };
    let hil = Hil::new(inputs, dynamics, method.alpha(settings), settings, seed)?;
    run(Box::new(hil), settings, hooks)
}
