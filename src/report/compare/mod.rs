//! Two evaluations, or two groups of them, beside each other: by episode where both were tried on the same ones, by seed where there are several.

mod evaluated;
mod pairing;
mod seeds;
mod words;

pub use evaluated::{Evaluated, find};
pub use pairing::{Change, Comparison, compare};
pub use seeds::{BySeeds, by_seeds};
