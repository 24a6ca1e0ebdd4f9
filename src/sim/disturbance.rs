//! What stands between command and motor: Gaussian noise, and pulses that push the arm off its way.

use crate::config::SimulateSettings;
use crate::robot::VELOCITY_LIMITS_RAD_S;
use crate::state::{ARM_JOINTS, Action};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Turns commanded into executed actions, along one episode.
#[derive(Clone, Debug)]
pub struct Disturbance {
    settings: SimulateSettings,
    rng: ChaCha8Rng,
    /// Extra velocity of the running pulse on the arm's joints \[rad/s\].
    pulse_rad_s: [f64; ARM_JOINTS],
    /// Control steps that the pulse still lasts.
    pulse_left: u32,
}

impl Disturbance {
    /// Noise and pulses of one episode, drawn from `rng`.
    pub fn new(settings: &SimulateSettings, rng: ChaCha8Rng) -> Self {
        Disturbance { settings: settings.clone(), rng, pulse_rad_s: [0.0; ARM_JOINTS], pulse_left: 0 }
    }

    /// Executed action \[rad/s\]: commanded + N(0, `noise_variance`) on all nine joints + the pulse on the arm, clamped to the joints'
    /// velocity limits and rounded to f32.
    pub fn apply(&mut self, commanded: &Action) -> Action {
        let sigma = self.settings.noise_variance.sqrt();
        self.advance_pulse();
        std::array::from_fn(|i| {
            let pulse = if i < ARM_JOINTS { self.pulse_rad_s[i] } else { 0.0 };
            clamp(commanded[i] + sigma * self.normal() + pulse, i)
        })
    }

    fn advance_pulse(&mut self) {
        let pulses = &self.settings.pulses;
        let (probability, sigma) = (pulses.probability, pulses.sigma_rad_s);
        if self.pulse_left > 0 {
            self.pulse_left -= 1;
        }
        if self.pulse_left == 0 {
            let begins = probability > 0.0 && self.rng.random::<f64>() < probability;
            self.pulse_left = if begins { pulses.steps } else { 0 };
            self.pulse_rad_s = std::array::from_fn(|_| if begins { sigma * self.normal() } else { 0.0 });
        }
    }

    fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.rng)
    }
}

/// `velocity` within the limits of joint `i` \[rad/s\], as a number that f32 holds.
fn clamp(velocity: f64, i: usize) -> f64 {
    let limit = VELOCITY_LIMITS_RAD_S[i] as f32;
    // Rounding must not carry it over the limit.
    let limit = if f64::from(limit) > VELOCITY_LIMITS_RAD_S[i] { limit.next_down() } else { limit };
    f64::from((velocity as f32).clamp(-limit, limit))
}
