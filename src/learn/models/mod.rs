//! What is learned, and what it is learned from: the policy pi_theta, the dynamics network f_phi, their inputs, the demos side by side.

mod corpus;
mod dynamics;
mod features;
mod hand;
mod model_report;
mod names;
mod older;
mod policy;
mod relations;
mod samples;
mod scaling;
mod weights;

pub use corpus::{Corpus, row};
pub use dynamics::{Dynamics, STEP_FLOOR};
pub use features::{Features, NEAR_M, derived_width};
pub use hand::{COS, HALF_PI, Hand, SIN, Series};
pub use model_report::{ModelReport, error_table};
pub use policy::Policy;
pub use samples::{ModelSamples, PolicySamples, Samples};
pub use scaling::Scaling;
pub use weights::{Reader, vector};
