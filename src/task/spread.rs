//! Numbers that may be drawn anew for every episode.

use rand::{Rng, RngExt};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// A number of the scene: fixed, or drawn anew for every episode.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a number, or a range to draw from: [low, high]")]
pub enum Spread {
    /// The same in every episode.
    Fixed(f64),
    /// Uniform between low and high.
    Between([f64; 2]),
}

impl Spread {
    /// The value of one episode. A fixed one takes nothing from `rng`.
    pub fn draw(self, rng: &mut impl Rng) -> f64 {
        match self {
            Spread::Fixed(value) => value,
            Spread::Between([low, high]) => low + (high - low) * rng.random::<f64>(),
        }
    }

    /// Lowest and highest value.
    pub fn ends(self) -> [f64; 2] {
        match self {
            Spread::Fixed(value) => [value; 2],
            Spread::Between(ends) => ends,
        }
    }
}

impl fmt::Display for Spread {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Spread::Fixed(value) => write!(f, "{value}"),
            Spread::Between(range) => write!(f, "{range:?}"),
        }
    }
}
