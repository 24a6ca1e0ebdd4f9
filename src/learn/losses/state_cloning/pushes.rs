//! Disturbances of the rollouts of Algorithm 3: the policy is pushed off its path in the dynamics network, and L_SC asks it back.

use crate::config::{PulseSettings, ScSettings};
use crate::layout::Layout;
use crate::pulse::Pulse;
use crate::seed::normal;
use rand::Rng;
use std::ops::Range;

/// Noise and pulses as in the simulator, for all steps of an update at once.
pub struct Pushes {
    sigma_rad_s: f32,
    pulses: PulseSettings,
    /// Entries of an action, and those of them that pulses push.
    dim: usize,
    arm: Range<usize>,
    pulse: Pulse,
    rows: Vec<f32>,
}

impl Pushes {
    /// As the settings say, with room for `most_rows` transitions. Pulses push the arm.
    pub fn new(settings: &ScSettings, layout: &Layout, most_rows: usize) -> Self {
        let (dim, arm) = (layout.action_dim(), layout.arm());
        let sigma_rad_s = settings.noise_variance.sqrt() as f32;
        let (pulse, rows) = (Pulse::new(arm.len()), Vec::with_capacity(most_rows * dim));
        Pushes { sigma_rad_s, pulses: settings.pulses.clone(), dim, arm, pulse, rows }
    }

    /// Draws the disturbances of demos of these lengths.
    pub fn draw(&mut self, lengths: impl Iterator<Item = usize>, rng: &mut impl Rng) {
        self.rows.clear();
        if self.sigma_rad_s == 0.0 && self.pulses.probability == 0.0 {
            return;
        }
        for length in lengths {
            self.pulse.end();
            for _ in 0..length {
                let unit = self.pulse.advance(&self.pulses, rng);
                let (sigma, pulse_sigma) = (self.sigma_rad_s, self.pulses.sigma_rad_s as f32);
                let push = |i: usize| if self.arm.contains(&i) { pulse_sigma * unit[i - self.arm.start] as f32 } else { 0.0 };
                self.rows.extend((0..self.dim).map(|i| sigma * normal(rng) as f32 + push(i)));
            }
        }
    }

    /// The disturbances drawn last \[rad/s\], transitions x A; empty when there are none.
    pub fn rows(&self) -> &[f32] {
        &self.rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::tests::testing::{ARM_JOINTS as ARM, JOINTS as DIM, Toy};
    use crate::seed::stream;

    fn drawn(settings: &ScSettings, lengths: &[usize]) -> Vec<f32> {
        let mut pushes = Pushes::new(settings, &Toy::PickUp.layout(), 10);
        pushes.draw(lengths.iter().copied(), &mut stream(1, "pushes", 0));
        pushes.rows
    }

    #[test]
    fn pulses_last_their_steps_on_the_arm_and_end_with_the_demo() {
        let pulses = PulseSettings { probability: 1.0, steps: 3, sigma_rad_s: 0.2 };
        let rows = drawn(&ScSettings { noise_variance: 0.0, pulses, ..Default::default() }, &[4, 2]);
        let row = |t: usize| &rows[t * DIM..(t + 1) * DIM];
        assert!(row(0) == row(2) && row(2) != row(3) && row(3) != row(4) && row(4) == row(5), "{rows:?}");
        assert!((0..6).all(|t| row(t)[ARM..] == [0.0; DIM - ARM]));
    }

    #[test]
    fn the_noise_has_its_variance_on_all_joints() {
        let off = PulseSettings { probability: 0.0, ..PulseSettings::default() };
        let settings = ScSettings { noise_variance: 0.04, pulses: off, ..Default::default() };
        let rows = drawn(&settings, &[2000]);
        for joint in 0..DIM {
            let variance = rows.chunks(DIM).map(|row| row[joint].powi(2)).sum::<f32>() / 2000.0;
            assert!((variance - 0.04).abs() < 0.006, "joint {joint}: {variance}");
        }
        assert!(drawn(&ScSettings { noise_variance: 0.0, ..settings }, &[5]).is_empty());
    }
}
