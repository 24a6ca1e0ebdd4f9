//! Pulses: numbers that stay for a few control steps and come now and then. Pushes on the arm, the same in the simulator and in the rollouts of
//! state cloning, and commands of the fingers.

use crate::config::PulseSettings;
use crate::seed::normal;
use rand::{Rng, RngExt};

/// The pulse that is under way, if one is.
#[derive(Clone, Debug)]
pub struct Pulse {
    /// Control steps that it still lasts.
    left: u32,
    values: Vec<f64>,
}

impl Pulse {
    /// None yet, of so many numbers.
    pub fn new(width: usize) -> Self {
        Pulse { left: 0, values: vec![0.0; width] }
    }

    /// Ends what is under way.
    pub fn end(&mut self) {
        self.left = 0;
    }

    /// The next control step: the pulse's numbers, each of which `draw` gave when it began; `None` without a pulse. One begins with
    /// `probability` in each step outside of one, and lasts `steps`, at least 1.
    pub fn next<R: Rng>(
        &mut self,
        (probability, steps): (f64, u32),
        rng: &mut R,
        mut draw: impl FnMut(&mut R) -> f64,
    ) -> Option<&[f64]> {
        self.left = self.left.saturating_sub(1);
        if self.left == 0 && probability > 0.0 && rng.random::<f64>() < probability {
            self.left = steps;
            self.values.iter_mut().for_each(|value| *value = draw(rng));
        }
        (self.left > 0).then_some(&self.values)
    }

    /// The next control step: constant velocities on the arm's joints in units of `settings.sigma_rad_s`, 0 without a pulse.
    pub fn advance(&mut self, settings: &PulseSettings, rng: &mut impl Rng) -> &[f64] {
        if self.next((settings.probability, settings.steps), rng, |rng| normal(rng)).is_none() {
            self.values.fill(0.0);
        }
        &self.values
    }
}
