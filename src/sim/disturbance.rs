//! What stands between command and motor: a delay, Gaussian noise, and pulses that push the arm off its way.

use crate::config::SimulateSettings;
use crate::joints::Joints;
use crate::pulse::Pulse;
use crate::robot::Robot;
use crate::seed::normal;
use crate::state::Action;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::collections::VecDeque;
use std::sync::Arc;

/// Turns commanded into executed actions, along one episode.
#[derive(Clone, Debug)]
pub struct Disturbance {
    robot: Arc<Robot>,
    settings: SimulateSettings,
    rng: ChaCha8Rng,
    pulse: Pulse,
    /// Commands that do not act yet; none without a delay.
    pending: VecDeque<Action>,
}

impl Disturbance {
    /// Delay, noise and pulses of one episode of a robot, drawn from `rng`.
    pub fn new(robot: &Arc<Robot>, settings: &SimulateSettings, mut rng: ChaCha8Rng) -> Self {
        let [low, high] = settings.delay_steps.ends().map(f64::round);
        // Each whole number of the range as often as any other. A fixed one takes nothing from the stream.
        let delay = if low < high { (low + (high - low + 1.0) * rng.random::<f64>()).floor() } else { low };
        let pending = vec![Joints::zeros(robot.joints.len()); delay as usize].into();
        Disturbance { robot: Arc::clone(robot), settings: settings.clone(), rng, pulse: Pulse::new(robot.arm), pending }
    }

    /// Executed action \[rad/s, m/s\]: what was commanded `delay_steps` ago (before the first command the arm stands still) + N(0,
    /// `noise_variance`) on all joints + the pulse on the arm, clamped to the joints' velocity
    /// limits and rounded to f32. The noise of a joint that slides is by [`crate::robot::model::Joint::per_radian`].
    pub fn apply(&mut self, commanded: &Action) -> Action {
        self.pending.push_back(*commanded);
        let commanded = self.pending.pop_front().expect("one was added just now");
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::file::built_in::paper_robot;
    use crate::seed::stream;
    use crate::task::Spread;

    /// What acts in each step, when step t asks every joint for t / 100 rad/s without noise.
    fn acting(delay_steps: Spread, index: u64) -> Vec<f64> {
        let settings = SimulateSettings { noise_variance: 0.0, delay_steps, ..SimulateSettings::default() };
        let mut disturbance = Disturbance::new(&paper_robot(), &settings, stream(3, "delay test", index));
        (1..=8).map(|t| disturbance.apply(&Joints::from_fn(9, |_| f64::from(t) / 100.0))[4]).collect()
    }

    #[test]
    fn a_delayed_command_acts_later_and_the_arm_stands_still_before() {
        let near = |found: &[f64], expected: &[f64]| found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(near(&acting(Spread::Fixed(0.0), 0), &[0.01, 0.02, 0.03, 0.04]));
        assert!(near(&acting(Spread::Fixed(3.0), 0), &[0.0, 0.0, 0.0, 0.01, 0.02, 0.03, 0.04, 0.05]));
        let still = |index| acting(Spread::Between([1.0, 3.0]), index).iter().filter(|v| **v == 0.0).count();
        let mut counts = [0; 5];
        (0..300).for_each(|index| counts[still(index)] += 1);
        assert!(counts[0] == 0 && counts[4] == 0 && counts[1..4].iter().all(|n| *n > 70), "delays of 1 to 3 steps: {counts:?}");
    }

    /// The bytes of what was recorded before there were delays.
    #[test]
    fn a_fixed_delay_leaves_the_noise_as_it_is() {
        let noise = |delay_steps: f64| {
            let settings = SimulateSettings { delay_steps: Spread::Fixed(delay_steps), ..SimulateSettings::default() };
            let mut disturbance = Disturbance::new(&paper_robot(), &settings, stream(3, "delay test", 0));
            (0..5).map(|_| disturbance.apply(&Joints::zeros(9))).collect::<Vec<_>>()
        };
        assert_eq!(noise(0.0), noise(3.0));
    }
}
