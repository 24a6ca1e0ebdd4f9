//! Learning: the paper's networks, its losses, and the methods that descend them.
//!
//! - [`models`]: pi_theta and f_phi, what they see, the demos side by side
//! - [`losses`]: L_BC (Algorithm 2), L_SC (Algorithm 3), L_model (Eq. 6), each with its gradient
//! - [`run`](mod@run): the loop around any method: epochs, checkpoints, metrics, selection
//! - [`methods`]: Algorithm 1 (HIL, with BC and SC as its ends), Algorithm 4 (pretraining of f_phi), PPO, which learns by trial, and BC + RL

mod limits;
pub mod losses;
pub mod methods;
pub mod models;
pub mod run;
#[cfg(test)]
mod tests;

pub use methods::{BcRl, Hil, Inputs, MethodName, Ppo, imitator, pretrain_dynamics, train};
pub use models::{Dynamics, ModelReport, Policy};
pub use run::{Checkpoint, EpochMetrics, Hooks, Method, Metric, Selection, Trained, run};
