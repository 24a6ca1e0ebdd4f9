//! Pulses: pushes of a few control steps on the arm, the same in the simulator and in the rollouts of state cloning.

use crate::config::PulseSettings;
use crate::seed::normal;
use crate::state::ARM_JOINTS;
use rand::{Rng, RngExt};

/// The pulse that is under way, if one is.
#[derive(Clone, Debug, Default)]
pub struct Pulse {
    /// Control steps that it still lasts.
    left: u32,
    unit: [f64; ARM_JOINTS],
}

impl Pulse {
    /// The next control step: constant velocities on the arm's joints in units of `settings.sigma_rad_s`, 0 without a pulse.
    pub fn advance(&mut self, settings: &PulseSettings, rng: &mut impl Rng) -> [f64; ARM_JOINTS] {
        self.left = self.left.saturating_sub(1);
        if self.left == 0 {
            let begins = settings.probability > 0.0 && rng.random::<f64>() < settings.probability;
            self.left = if begins { settings.steps } else { 0 };
            self.unit = std::array::from_fn(|_| if begins { normal(rng) } else { 0.0 });
        }
        self.unit
    }
}
