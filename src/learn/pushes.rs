//! Disturbances of the rollouts of Algorithm 3: the policy is pushed off its path in the dynamics network, and L_SC asks it back.

use crate::config::{PulseSettings, TrainSettings};
use crate::state::{ARM_JOINTS, JOINTS};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

/// Noise and pulses as in the simulator (`sim::Disturbance`), for all steps of an update at once.
pub struct Pushes {
    sigma_rad_s: f32,
    pulses: PulseSettings,
    rows: Vec<f32>,
}

impl Pushes {
    /// As the settings say.
    pub fn new(settings: &TrainSettings) -> Self {
        Pushes { sigma_rad_s: settings.sc_noise_variance.sqrt() as f32, pulses: settings.sc_pulses.clone(), rows: Vec::new() }
    }

    /// Draws the disturbances of demos of these lengths.
    pub fn draw(&mut self, lengths: impl Iterator<Item = usize>, rng: &mut impl Rng) {
        self.rows.clear();
        if self.sigma_rad_s == 0.0 && self.pulses.probability == 0.0 {
            return;
        }
        for length in lengths {
            let (mut left, mut pulse) = (0, [0.0f32; ARM_JOINTS]);
            for _ in 0..length {
                if left == 0 {
                    let begins = rng.random::<f64>() < self.pulses.probability;
                    left = if begins { self.pulses.steps } else { 1 };
                    let sigma = if begins { self.pulses.sigma_rad_s as f32 } else { 0.0 };
                    pulse = std::array::from_fn(|_| if begins { sigma * normal(rng) } else { 0.0 });
                }
                left -= 1;
                let sigma = self.sigma_rad_s;
                self.rows.extend((0..JOINTS).map(|i| sigma * normal(rng) + pulse.get(i).copied().unwrap_or(0.0)));
            }
        }
    }

    /// The disturbances drawn last \[rad/s\], transitions x 9; empty when there are none.
    pub fn rows(&self) -> &[f32] {
        &self.rows
    }
}

fn normal(rng: &mut impl Rng) -> f32 {
    StandardNormal.sample(rng)
}
