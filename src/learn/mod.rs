//! The paper's method: hybrid imitation learning and its parts, one file an algorithm.

pub mod behavior_cloning;
mod checkpoint;
mod corpus;
mod cost;
mod dynamics;
mod exact;
mod features;
mod fine_tuning;
#[cfg(test)]
mod gradient_tests;
mod hand;
pub mod hil;
mod learner;
mod limits;
mod metrics;
mod model_report;
mod multi_step;
mod past;
mod patience;
mod policy;
pub mod ppo;
pub mod pretrain_dynamics;
mod pushes;
mod regression;
#[cfg(test)]
mod resume_tests;
mod rollout;
mod run;
mod samples;
mod scaling;
mod selection;
mod shards;
pub mod state_cloning;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod training_tests;
mod weights;

pub use checkpoint::Checkpoint;
pub use dynamics::Dynamics;
pub use features::Features;
pub use hil::{Method, Trained, train};
pub use learner::Learner;
pub use metrics::EpochMetrics;
pub use model_report::ModelReport;
pub use policy::Policy;
pub use ppo::Ppo;
pub use pretrain_dynamics::pretrain_dynamics;
pub use run::{Hooks, Score};
pub use selection::{Candidate, Selection};
