//! What stands between command and motor: Gaussian noise, and pulses that push the arm off its way.

use crate::config::SimulateSettings;
use crate::pulse::Pulse;
use crate::robot::VELOCITY_LIMITS_RAD_S;
use crate::seed::normal;
use crate::state::{ARM_JOINTS, Action};
use rand_chacha::ChaCha8Rng;

/// Turns commanded into executed actions, along one episode.
#[derive(Clone, Debug)]
pub struct Disturbance {
    settings: SimulateSettings,
    rng: ChaCha8Rng,
    pulse: Pulse,
}

impl Disturbance {
    /// Noise and pulses of one episode, drawn from `rng`.
    pub fn new(settings: &SimulateSettings, rng: ChaCha8Rng) -> Self {
        Disturbance { settings: settings.clone(), rng, pulse: Pulse::new(ARM_JOINTS) }
    }

    /// Executed action \[rad/s\]: commanded + N(0, `noise_variance`) on all nine joints + the pulse on the arm, clamped to the joints'
    /// velocity limits and rounded to f32.
    pub fn apply(&mut self, commanded: &Action) -> Action {
        let sigma = self.settings.noise_variance.sqrt();
        let unit = self.pulse.advance(&self.settings.pulses, &mut self.rng);
        std::array::from_fn(|i| {
            let pulse = unit.get(i).map_or(0.0, |unit| self.settings.pulses.sigma_rad_s * unit);
            clamp(commanded[i] + sigma * normal(&mut self.rng) + pulse, i)
        })
    }
}

/// `velocity` within the limits of joint `i` \[rad/s\], as a number that f32 holds.
fn clamp(velocity: f64, i: usize) -> f64 {
    let limit = VELOCITY_LIMITS_RAD_S[i] as f32;
    // Rounding must not carry it over the limit.
    let limit = if f64::from(limit) > VELOCITY_LIMITS_RAD_S[i] { limit.next_down() } else { limit };
    f64::from((velocity as f32).clamp(-limit, limit))
}
