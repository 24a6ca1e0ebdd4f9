//! A toy world whose optimum is known: a linear system with quadratic costs.

use crate::env::{End, Env, Outcome};
use crate::error::Result;
use crate::seed::stream;
use crate::state::JOINTS;
use crate::task::Task;
use rand::RngExt;

/// Two joints are to come to 0: x' = x + GAIN u, a step costs x^2 + EFFORT u^2 each, and an episode is cut off.
pub struct Regulator {
    seed: u64,
    x: [f32; 2],
    left: u32,
}

const GAIN: f64 = 0.5;
const EFFORT: f64 = 0.2;
const STEPS: u32 = 20;
/// What a reward is worth a step later.
pub const GAMMA: f64 = 0.9;
/// The task whose states and actions it borrows.
pub const TASK: Task = Task::PickUp;

impl Regulator {
    /// Whose starts come from this seed.
    pub fn new(seed: u64) -> Self {
        Regulator { seed, x: [0.0; 2], left: 0 }
    }

    fn show(&self, observation: &mut [f32]) {
        observation.fill(0.0);
        observation[..2].copy_from_slice(&self.x);
    }
}

impl Env for Regulator {
    fn observation_len(&self) -> usize {
        TASK.state_dim()
    }

    fn action_len(&self) -> usize {
        JOINTS
    }

    fn reset(&mut self, episode: u64, observation: &mut [f32]) -> Result<()> {
        let mut rng = stream(self.seed, "toy.start", episode);
        self.x = std::array::from_fn(|_| 2.0 * rng.random::<f32>() - 1.0);
        self.left = STEPS;
        self.show(observation);
        Ok(())
    }

    fn step(&mut self, action: &[f32], observation: &mut [f32]) -> Outcome {
        let costs = self.x.iter().zip(action).map(|(x, u)| x * x + EFFORT as f32 * u * u);
        let reward = 1.0 - costs.sum::<f32>();
        self.x.iter_mut().zip(action).for_each(|(x, u)| *x += GAIN as f32 * u);
        self.left -= 1;
        self.show(observation);
        Outcome { reward, end: (self.left == 0).then_some(End::Truncated), success: false }
    }
}

/// Mean discounted cost of a controller from some starts, over so many steps that the rest counts for nothing.
pub fn cost(mut control: impl FnMut(&[f32]) -> [f32; 2]) -> f64 {
    let mut world = Regulator::new(12);
    let mut seen = vec![0.0; TASK.state_dim()];
    let mut total = 0.0;
    for episode in 0..20 {
        world.reset(episode, &mut seen).expect("a start");
        world.left = u32::MAX;
        let mut weight = 1.0;
        for _ in 0..100 {
            let mut action = [0.0; JOINTS];
            action[..2].copy_from_slice(&control(&seen));
            total += weight * (1.0 - f64::from(world.step(&action, &mut seen).reward));
            weight *= GAMMA;
        }
    }
    total / 20.0
}

/// The gain of the best controller, u = -k x: the discounted Riccati equation in one dimension.
pub fn best_gain() -> f64 {
    let mut p = 1.0f64;
    for _ in 0..1000 {
        p = 1.0 + GAMMA * p - (GAMMA * p * GAIN).powi(2) / (EFFORT + GAMMA * p * GAIN * GAIN);
    }
    GAMMA * p * GAIN / (EFFORT + GAMMA * p * GAIN * GAIN)
}
