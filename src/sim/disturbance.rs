//! What stands between command and motor: Gaussian noise, and pulses that push the arm off its way.

use crate::config::SimulateSettings;
use crate::joints::Joints;
use crate::pulse::Pulse;
use crate::robot::Robot;
use crate::seed::normal;
use crate::state::Action;
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;

/// Turns commanded into executed actions, along one episode.
#[derive(Clone, Debug)]
pub struct Disturbance {
    robot: Arc<Robot>,
    settings: SimulateSettings,
    rng: ChaCha8Rng,
    pulse: Pulse,
}

impl Disturbance {
    /// Noise and pulses of one episode of a robot, drawn from `rng`.
    pub fn new(robot: &Arc<Robot>, settings: &SimulateSettings, rng: ChaCha8Rng) -> Self {
        Disturbance { robot: Arc::clone(robot), settings: settings.clone(), rng, pulse: Pulse::new(robot.arm) }
    }

    /// Executed action \[rad/s, m/s\]: commanded + N(0, `noise_variance`) on all joints + the pulse on the arm, clamped to the joints' velocity
    /// limits and rounded to f32. The noise of a joint that slides is by [`crate::robot::model::Joint::per_radian`].
    pub fn apply(&mut self, commanded: &Action) -> Action {
        let sigma = self.settings.noise_variance.sqrt();
        let unit = self.pulse.advance(&self.settings.pulses, &mut self.rng);
        Joints::from_fn(commanded.len(), |i| {
            let joint = &self.robot.joints[i];
            let pulse = unit.get(i).map_or(0.0, |unit| self.settings.pulses.sigma_rad_s * unit);
            clamp(commanded[i] + joint.per_radian() * sigma * normal(&mut self.rng) + pulse, joint.velocity)
        })
    }
}

/// `velocity` within `most` either way, as a number that f32 holds.
fn clamp(velocity: f64, most: f64) -> f64 {
    let limit = most as f32;
    // Rounding must not carry it over the limit.
    let limit = if f64::from(limit) > most { limit.next_down() } else { limit };
    f64::from((velocity as f32).clamp(-limit, limit))
}
