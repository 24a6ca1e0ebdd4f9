//! What is allowed for every number of a pipeline file.

use std::fmt;
use toml::Value;

/// An interval of numbers for one key; each entry of a list must lie in it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Range {
    /// The dotted key.
    pub key: &'static str,
    low: f64,
    high: f64,
    /// Whether `low` itself is refused.
    above_low: bool,
}

const fn within(key: &'static str, low: f64, high: f64) -> Range {
    Range { key, low, high, above_low: false }
}

const fn above(key: &'static str, low: f64, high: f64) -> Range {
    Range { key, low, high, above_low: true }
}

/// The arm reaches 0.98 m; nothing that matters lies beyond this \[m\].
const WORKSPACE_M: f64 = 2.0;
/// More episodes than any experiment needs, few enough to fit in memory and in five-digit file names.
pub(super) const MOST_EPISODES: f64 = 100_000.0;
/// A run of 500 s; keeps a slip of the finger from allocating all memory.
const MOST_STEPS: f64 = 10_000.0;

/// One line for every number outside `[pretrain]` and `[train]`, which check themselves; a test holds the list complete.
pub(super) const RANGES: &[Range] = &[
    within("scene.spawn_x_m", -WORKSPACE_M, WORKSPACE_M),
    within("scene.spawn_y_m", -WORKSPACE_M, WORKSPACE_M),
    within("scene.goal_x_m", -WORKSPACE_M, WORKSPACE_M),
    within("scene.goal_y_m", -WORKSPACE_M, WORKSPACE_M),
    within("scene.base_xy_m", -WORKSPACE_M, WORKSPACE_M),
    within("scene.friction", 0.0, 10.0),
    above("scene.block_mass_kg", 0.0, 10.0),
    within("scene.obstacles.center_m", -WORKSPACE_M, WORKSPACE_M),
    above("scene.obstacles.size_m", 0.0, 2.0 * WORKSPACE_M),
    within("plan.episodes", 1.0, MOST_EPISODES),
    above("plan.speed", 0.0, 1.0),
    above("plan.max_acceleration_rad_s2", 0.0, 100.0),
    within("plan.search_iterations", 1.0, 10_000_000.0),
    within("plan.shortcut_iterations", 0.0, 10_000_000.0),
    within("simulate.noise_variance", 0.0, 1.0),
    within("simulate.max_steps", 1.0, MOST_STEPS),
    within("simulate.pulses.probability", 0.0, 1.0),
    within("simulate.pulses.steps", 1.0, MOST_STEPS),
    within("simulate.pulses.sigma_rad_s", 0.0, 10.0),
    within("convert.train_per_validation", 1.0, MOST_EPISODES),
    within("convert.demos", 0.0, MOST_EPISODES),
    within("evaluate.episodes", 1.0, MOST_EPISODES),
    within("evaluate.horizon_steps", 0.0, MOST_STEPS),
];

impl Range {
    /// The range of a dotted key.
    pub fn of(key: &str) -> Option<Range> {
        RANGES.iter().find(|r| r.key == key).copied()
    }

    /// Whether a value, or every entry of a list, lies within; otherwise key, value and what is allowed.
    pub fn check(self, key: &str, value: &Value) -> Result<(), String> {
        let number = match value {
            Value::Integer(i) => *i as f64,
            Value::Float(f) => *f,
            Value::Array(items) => return items.iter().try_for_each(|item| self.check(key, item)),
            _ => return Ok(()),
        };
        let low_kept = if self.above_low { number > self.low } else { number >= self.low };
        if low_kept && number <= self.high && number.is_finite() {
            return Ok(());
        }
        Err(format!("{key} = {value}: out of range; allowed: {self}"))
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let low = if self.above_low { format!("above {} up", self.low) } else { self.low.to_string() };
        write!(f, "{low} to {}", self.high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::check::{example, leaves};

    fn is_number(value: &Value) -> bool {
        match value {
            Value::Integer(_) | Value::Float(_) => true,
            Value::Array(items) => items.iter().any(is_number),
            _ => false,
        }
    }

    #[test]
    fn every_number_has_a_range_and_every_range_a_number() {
        let numbers: Vec<String> = leaves(&example()).into_iter().filter(|(_, v)| is_number(v)).map(|(k, _)| k).collect();
        // The sections of learning check themselves.
        for key in numbers.iter().filter(|k| !k.starts_with("pretrain.") && !k.starts_with("train.")) {
            assert!(Range::of(key).is_some(), "{key} has no range");
        }
        for range in RANGES {
            assert!(numbers.iter().any(|key| key == range.key), "{} is no key", range.key);
        }
    }
}
