//! Small multilayer perceptrons: forward and backward side by side, a Gaussian head, Adam. Knows nothing of robots.
//!
//! Samples lie in panels of eight rows ([`panels`]), parameters in flat row-major arrays, all f32. Nothing here allocates once its
//! workspace ([`Pass`]) has grown to the batch. Matrix products with what ends them ([`kernel`]) pick their instructions by the processor's
//! features; their results, like all others, have the same bits on every processor.

pub mod activation;
pub mod adam;
pub mod gaussian;
pub mod kernel;
pub mod lanes;
pub mod mlp;
pub mod panels;
mod pass;
mod room;

pub use activation::Activation;
pub use adam::{Adam, Ema, clip_by_global_norm, cosine, global_norm};
pub use lanes::{LANES, Lanes, panels_of};
pub use mlp::Mlp;
pub use panels::Panels;
pub use pass::{BLOCK_PANELS, Pass};
