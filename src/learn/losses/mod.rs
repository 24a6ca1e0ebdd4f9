//! The losses and their gradients. Those of the policy begin where it has [`Acted`] in the states of the demos; none needs another.

mod acted;
pub mod behavior_cloning;
pub mod convergence;
pub mod model_loss;
mod offsets;
mod policy_loss;
mod regression;
pub(in crate::learn) mod shards;
pub mod state_cloning;

pub use acted::Acted;
pub use behavior_cloning::behavior_cloning;
pub use model_loss::ModelLearner;
pub use offsets::Offsets;
pub use policy_loss::{Mixture, PolicyLoss};
pub use state_cloning::{StateCloning, state_cloning};
