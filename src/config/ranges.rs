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
    /// Whether `high` itself is refused.
    below_high: bool,
    /// The least that is allowed above `low`, and why.
    least: Option<(f64, &'static str)>,
}

const fn within(key: &'static str, low: f64, high: f64) -> Range {
    Range { key, low, high, above_low: false, below_high: false, least: None }
}

const fn above(key: &'static str, low: f64, high: f64) -> Range {
    Range { above_low: true, ..within(key, low, high) }
}

const fn below(key: &'static str, low: f64, high: f64) -> Range {
    Range { below_high: true, ..within(key, low, high) }
}

/// The arm reaches 0.98 m; nothing that matters lies beyond this \[m\].
const WORKSPACE_M: f64 = 2.0;
/// More episodes than any experiment needs, few enough to fit in memory and in five-digit file names.
const MOST_EPISODES: f64 = 100_000.0;
/// Boxes of a scene: each is kept with every episode, and met by every distance of a plan.
pub(super) const MOST_OBSTACLES: usize = 100;
/// Most control steps of an episode, and samples of a plan: 500 s. Keeps a slip of the finger from allocating all memory.
pub const MOST_STEPS: u32 = 10_000;
/// Most control steps of an episode that a policy acts in: twice those of the longest demo.
pub const MOST_HORIZON_STEPS: u32 = 2 * MOST_STEPS;
const STEPS: f64 = MOST_STEPS as f64;
/// Longest delay of a command \[control steps\]: a second. No arm that takes longer is driven by joint velocities.
const LONGEST_DELAY_STEPS: f64 = 20.0;
/// Most hidden layers of a network.
pub const MOST_LAYERS: u32 = 16;
/// Most units of a hidden layer.
pub const MOST_UNITS: u32 = 4096;
/// Nodes of a search: the trees of so many fill the workspace, and finding the nearest among them takes seconds.
const MOST_ITERATIONS: f64 = 100_000.0;
/// Kilograms of the lightest block: a cube of foam. In the simulator's single precision a far lighter one vanishes beside the arm.
const LIGHTEST: (f64, &str) = (0.001, "a lighter block is lost in the simulator's single precision");
/// Epochs of a stage; each leaves a row in the metrics.
pub(super) const MOST_EPOCHS: f64 = 1_000_000.0;
/// Updates of a stage: hours of the smallest network.
const MOST_UPDATES: f64 = 10_000_000.0;
/// Control steps of reinforcement learning: weeks.
const MOST_TRIALS: f64 = 1e10;
/// Worlds side by side, half a megabyte each.
const MOST_WORLDS: f64 = 4096.0;
/// State-action pairs of an update.
const MOST_ROWS: f64 = 1_000_000.0;
/// What single precision holds; a learning rate, a norm or a scale beyond it is no number there.
const SINGLE: f64 = 1e38;
/// Scales between these keep their squares and their logarithms in single precision.
const SCALE: [f64; 2] = [1e-6, 1e3];

/// One line for every number of a pipeline file; a test holds the list complete.
pub(super) const RANGES: &[Range] = &[
    within("scene.spawn_x_m", -WORKSPACE_M, WORKSPACE_M),
    within("scene.spawn_y_m", -WORKSPACE_M, WORKSPACE_M),
    within("scene.goal_x_m", -WORKSPACE_M, WORKSPACE_M),
    within("scene.goal_y_m", -WORKSPACE_M, WORKSPACE_M),
    within("scene.base_xy_m", -WORKSPACE_M, WORKSPACE_M),
    within("scene.friction", 0.0, 10.0),
    Range { least: Some(LIGHTEST), ..above("scene.block_mass_kg", 0.0, 10.0) },
    within("scene.finger_friction", 0.0, 10.0),
    within("scene.obstacles.center_m", -WORKSPACE_M, WORKSPACE_M),
    above("scene.obstacles.size_m", 0.0, 2.0 * WORKSPACE_M),
    within("plan.episodes", 1.0, MOST_EPISODES),
    above("plan.speed", 0.0, 1.0),
    above("plan.max_acceleration_rad_s2", 0.0, 100.0),
    within("plan.search_iterations", 1.0, MOST_ITERATIONS),
    within("plan.shortcut_iterations", 0.0, MOST_ITERATIONS),
    within("simulate.noise_variance", 0.0, 1.0),
    within("simulate.delay_steps", 0.0, LONGEST_DELAY_STEPS),
    within("simulate.max_steps", 1.0, STEPS),
    within("simulate.pulses.probability", 0.0, 1.0),
    within("simulate.pulses.steps", 1.0, STEPS),
    within("simulate.pulses.sigma_rad_s", 0.0, 10.0),
    within("convert.train_per_validation", 1.0, MOST_EPISODES),
    within("convert.demos", 0.0, MOST_EPISODES),
    within("evaluate.episodes", 1.0, MOST_EPISODES),
    within("evaluate.horizon_steps", 0.0, STEPS),
    within("pretrain.hidden_layers", 1.0, MOST_LAYERS as f64),
    within("pretrain.hidden_units", 1.0, MOST_UNITS as f64),
    within("pretrain.reexecute", 0.0, 1000.0),
    within("pretrain.reexecute_pulses.probability", 0.0, 1.0),
    within("pretrain.reexecute_pulses.steps", 1.0, STEPS),
    within("pretrain.reexecute_pulses.sigma_rad_s", 0.0, 10.0),
    within("pretrain.reexecute_fingers.probability", 0.0, 1.0),
    within("pretrain.reexecute_fingers.steps", 1.0, STEPS),
    within("pretrain.reexecute_fingers.speed_rad_s", 0.0, 10.0),
    within("pretrain.epochs", 1.0, MOST_EPOCHS),
    within("pretrain.patience", 0.0, MOST_EPOCHS),
    below("pretrain.min_gain", 0.0, 1.0),
    within("pretrain.batch_rows", 0.0, MOST_ROWS),
    above("pretrain.learning_rate", 0.0, SINGLE),
    above("pretrain.final_learning_rate", 0.0, SINGLE),
    within("pretrain.clip_norm", 0.0, SINGLE),
    below("pretrain.ema_decay", 0.0, 1.0),
    within("train.hidden_layers", 1.0, MOST_LAYERS as f64),
    within("train.hidden_units", 1.0, MOST_UNITS as f64),
    within("train.initial_std", SCALE[0], SCALE[1]),
    within("train.std_floor", SCALE[0], SCALE[1]),
    within("train.tau", SCALE[0], SCALE[1]),
    within("train.alpha", 0.0, 1.0),
    within("train.alpha_max", 0.0, 1.0),
    within("train.rho", 0.0, 1.0),
    within("train.randomise.fingers_rad", 0.0, 1.0),
    within("train.randomise.objects_rad", 0.0, 1.0),
    within("train.sc.knee", 0.0, SINGLE),
    within("train.sc.noise_variance", 0.0, 1.0),
    within("train.sc.pulses.probability", 0.0, 1.0),
    within("train.sc.pulses.steps", 1.0, STEPS),
    within("train.sc.pulses.sigma_rad_s", 0.0, 10.0),
    above("train.dynamics_learning_rate", 0.0, SINGLE),
    within("train.warm_start_updates", 0.0, MOST_UPDATES),
    within("train.bc_batch", 1.0, MOST_ROWS),
    above("train.warm_start_learning_rate", 0.0, SINGLE),
    within("train.epochs", 0.0, MOST_EPOCHS),
    within("train.min_updates", 0.0, MOST_UPDATES),
    within("train.batch", 1.0, MOST_EPISODES),
    above("train.learning_rate", 0.0, SINGLE),
    above("train.final_learning_rate", 0.0, SINGLE),
    within("train.clip_norm", 0.0, SINGLE),
    below("train.ema_decay", 0.0, 1.0),
    within("train.select_episodes", 0.0, MOST_EPISODES),
    within("train.select_candidates", 1.0, MOST_EPOCHS),
    within("train.ppo.total_steps", 1.0, MOST_TRIALS),
    within("train.ppo.worlds", 1.0, MOST_WORLDS),
    within("train.ppo.steps", 1.0, STEPS),
    within("train.ppo.horizon_steps", 1.0, STEPS),
    below("train.ppo.gamma", 0.0, 1.0),
    within("train.ppo.gae_lambda", 0.0, 1.0),
    above("train.ppo.clip", 0.0, 10.0),
    within("train.ppo.epochs", 1.0, 1000.0),
    within("train.ppo.minibatch", 1.0, MOST_ROWS),
    above("train.ppo.learning_rate", 0.0, SINGLE),
    above("train.ppo.final_learning_rate", 0.0, SINGLE),
    above("train.ppo.value_learning_rate", 0.0, SINGLE),
    within("train.ppo.entropy", 0.0, SCALE[1]),
    within("train.ppo.target_kl", 0.0, SCALE[1]),
    within("train.ppo.clip_norm", 0.0, SINGLE),
    above("train.ppo.action_unit", 0.0, 10.0),
    within("train.ppo.initial_std", SCALE[0], SCALE[1]),
    within("train.bc_rl.lambda", 0.0, SCALE[1]),
    within("train.bc_rl.lambda_decay", 0.0, 1.0),
    within("train.bc_rl.value_iterations", 0.0, MOST_EPOCHS),
    within("train.bc_rl.initial_std", SCALE[0], SCALE[1]),
    above("train.bc_rl.learning_rate", 0.0, SINGLE),
];

impl Range {
    /// The range of a dotted key.
    pub fn of(key: &str) -> Option<Range> {
        RANGES.iter().find(|r| r.key == key).copied()
    }

    /// Whether a value, and every entry of a list, lies within.
    pub fn holds(self, value: &Value) -> bool {
        let number = match value {
            Value::Integer(i) => *i as f64,
            Value::Float(f) => *f,
            Value::Array(items) => return items.iter().all(|item| self.holds(item)),
            _ => return true,
        };
        let low_kept = if self.above_low { number > self.low } else { number >= self.low };
        let high_kept = if self.below_high { number < self.high } else { number <= self.high };
        low_kept && high_kept && self.least.is_none_or(|(least, _)| number >= least)
    }

    /// Whether a value lies within; otherwise key, value and what is allowed.
    pub fn check(self, key: &str, value: &Value) -> Result<(), String> {
        if self.holds(value) { Ok(()) } else { Err(format!("{key} = {value}: out of range; allowed: {self}")) }
    }

    /// What a number must be.
    pub fn must_be(self) -> String {
        match (self.above_low || self.below_high, self.low, self.high) {
            (true, ..) => self.to_string(),
            (false, 0.0, 1.0) => "between 0 and 1".into(),
            _ => format!("from {self}"),
        }
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let number = |n: f64| if n.abs() >= SINGLE { format!("{n:e}") } else { n.to_string() };
        let (low, high) = (number(self.low), number(self.high));
        match (self.above_low, self.below_high) {
            (true, _) => write!(f, "above {low} up to {high}")?,
            (false, true) => write!(f, "{low} up to below {high}")?,
            (false, false) => write!(f, "{low} to {high}")?,
        }
        self.least.map_or(Ok(()), |(least, why)| write!(f, ", no less than {least} ({why})"))
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
        for key in &numbers {
            assert!(Range::of(key).is_some(), "{key} has no range");
        }
        // These are words unless they are numbers.
        for range in RANGES.iter().filter(|r| !["train.alpha", "train.warm_start_updates"].contains(&r.key)) {
            assert!(numbers.iter().any(|key| key == range.key), "{} is no key", range.key);
        }
    }

    #[test]
    fn no_range_holds_what_is_no_number() {
        for range in RANGES {
            for number in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300] {
                assert!(!range.holds(&Value::Float(number)), "{} = {number}", range.key);
            }
        }
    }

    #[test]
    fn the_least_mass_is_said_with_its_reason() {
        let mass = Range::of("scene.block_mass_kg").expect("a range");
        let said = mass.check(mass.key, &Value::Float(1e-21)).expect_err("too light");
        assert!(said.contains("no less than 0.001 (a lighter block is lost"), "{said}");
        assert!(mass.holds(&Value::Float(0.001)) && !mass.holds(&Value::Float(0.0)));
    }
}
