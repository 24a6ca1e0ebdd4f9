//! Pulses: numbers that stay for a few control steps and come now and then. Pushes on the arm, the same in the simulator and in the rollouts of
//! state cloning, and commands of the fingers.

use crate::config::PulseSettings;
use crate::seed::normal;
use crate::state::ARM_JOINTS;
use rand::{Rng, RngExt};

/// The pulse that is under way, if one is.
#[derive(Clone, Debug)]
pub struct Pulse<const N: usize> {
    /// Control steps that it still lasts.
    left: u32,
    values: [f64; N],
}

impl<const N: usize> Default for Pulse<N> {
    fn default() -> Self {
        Pulse { left: 0, values: [0.0; N] }
    }
}

impl<const N: usize> Pulse<N> {
    /// The next control step: the pulse's numbers, each of which `draw` gave when it began; `None` without a pulse. One begins with
    /// `probability` in each step outside of one, and lasts `steps`, at least 1.
    pub fn next<R: Rng>(
        &mut self,
        (probability, steps): (f64, u32),
        rng: &mut R,
        mut draw: impl FnMut(&mut R) -> f64,
    ) -> Option<[f64; N]> {
        self.left = self.left.saturating_sub(1);
        if self.left == 0 && probability > 0.0 && rng.random::<f64>() < probability {
            self.left = steps;
            self.values = std::array::from_fn(|_| draw(rng));
        }
        (self.left > 0).then_some(self.values)
    }
}

impl Pulse<ARM_JOINTS> {
    /// The next control step: constant velocities on the arm's joints in units of `settings.sigma_rad_s`, 0 without a pulse.
    pub fn advance(&mut self, settings: &PulseSettings, rng: &mut impl Rng) -> [f64; ARM_JOINTS] {
        self.next((settings.probability, settings.steps), rng, |rng| normal(rng)).unwrap_or_default()
    }
}
