//! Small multilayer perceptrons: forward and backward side by side, a Gaussian head, Adam. Knows nothing of robots.
//!
//! All arrays are row-major f32, one sample a row. Nothing here allocates once its workspace ([`Pass`]) has grown to the batch.
//! Element-wise kernels use no fused multiply-add, so that they give the same bytes on every processor; only the matrix products
//! ([`matmul`]) pick a kernel by the processor's features.

pub mod activation;
pub mod adam;
pub mod gaussian;
pub mod matmul;
pub mod mlp;
mod pass;

pub use activation::Activation;
pub use adam::{Adam, Ema, clip_by_global_norm, cosine, global_norm};
pub use mlp::Mlp;
pub use pass::Pass;
