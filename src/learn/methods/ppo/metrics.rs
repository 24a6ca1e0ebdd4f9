//! What an iteration has seen, by name.

use super::group::Record;
use super::objective::Seen;
use crate::learn::run::Metric;

/// The numbers of an iteration.
pub static METRICS: [Metric; 13] = [
    Metric::column("env_steps", "Control steps of all worlds so far"),
    Metric::column("episodes", "Episodes that ended in the iteration"),
    Metric::shown("mean_return", "return", "Mean sum of rewards of these episodes"),
    Metric::shown("mean_length", "length", "Mean number of control steps of these episodes"),
    Metric::shown("success_rate", "success", "Share of these episodes that were solved, by sampled actions"),
    Metric::shown("kl", "kl", "Divergence from the policy that acted, at the last update"),
    Metric::shown("entropy", "entropy", "Entropy of the actions, in the policy's units (nats)"),
    Metric::column("clipped", "Share of steps beyond the clip, mean over the updates"),
    Metric::column("policy_loss", "Minus the clipped objective, mean over the updates"),
    Metric::column("value_loss", "Loss of the value network, mean over the updates"),
    Metric::shown("explained", "explained", "Share of the returns' variance that the value network had foreseen"),
    Metric::column("iteration_updates", "Updates of the iteration"),
    Metric::column("learning_rate", "Learning rate of the policy"),
];

/// The numbers of an iteration in the order of [`METRICS`]; NaN where there is none.
pub type Row = [f64; 13];

/// Counts along one iteration.
pub struct Tally {
    episodes: f64,
    earned: f64,
    steps: f64,
    solved: f64,
    explained: f64,
    updates: f64,
    last: Seen,
    policy_loss: f64,
    value_loss: f64,
    clipped: f64,
}

impl Tally {
    /// After the worlds have acted.
    pub fn new(records: &[Record]) -> Self {
        let mut tally = Tally {
            episodes: 0.0,
            earned: 0.0,
            steps: 0.0,
            solved: 0.0,
            explained: explained(records),
            updates: 0.0,
            last: Seen::default(),
            policy_loss: 0.0,
            value_loss: 0.0,
            clipped: 0.0,
        };
        for episode in records.iter().flat_map(|record| &record.finished) {
            tally.episodes += 1.0;
            tally.earned += episode.earned;
            tally.steps += episode.steps as f64;
            tally.solved += if episode.success { 1.0 } else { 0.0 };
        }
        tally
    }

    /// Takes in an update.
    pub fn see(&mut self, seen: &Seen) {
        self.updates += 1.0;
        self.policy_loss += seen.policy_loss;
        self.value_loss += seen.value_loss;
        self.clipped += seen.clipped;
        self.last = *seen;
    }

    /// Updates so far.
    pub fn updates(&self) -> u64 {
        self.updates as u64
    }

    /// In the order of [`METRICS`].
    pub fn row(&self, steps: u64, learning_rate: f64, log_std: &[f32]) -> Row {
        // Of a Gaussian, in nats: half of ln(2 pi e) and the logarithm of its spread, for each action.
        let half = 0.5 * (1.0 + crate::math::ln(2.0 * std::f64::consts::PI));
        [
            steps as f64,
            self.episodes,
            self.earned / self.episodes,
            self.steps / self.episodes,
            self.solved / self.episodes,
            self.last.kl,
            log_std.iter().map(|l| half + f64::from(*l)).sum(),
            self.clipped / self.updates,
            self.policy_loss / self.updates,
            self.value_loss / self.updates,
            self.explained,
            self.updates,
            learning_rate,
        ]
    }
}

/// 1 - variance(returns - values) / variance(returns).
fn explained(records: &[Record]) -> f64 {
    let variance = |of: &dyn Fn(f64, f64) -> f64| {
        let pairs = || records.iter().flat_map(|g| g.returns.iter().zip(&g.values)).flat_map(|(r, v)| r.0.into_iter().zip(v.0));
        let (mut sum, mut square, mut count) = (0.0, 0.0, 0.0);
        for (r, v) in pairs() {
            let x = of(f64::from(r), f64::from(v));
            (sum, square, count) = (sum + x, square + x * x, count + 1.0);
        }
        square / count - (sum / count).powi(2)
    };
    1.0 - variance(&|r, v| r - v) / variance(&|r, _| r)
}
