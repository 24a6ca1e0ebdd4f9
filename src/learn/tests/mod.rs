//! Tests of learning as a whole, on toy demos.

mod gradients;
mod resume;
pub mod testing;
mod training;
