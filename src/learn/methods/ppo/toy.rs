//! A toy world whose optimum is known: a linear system with quadratic costs.

use crate::demo::Demo;
use crate::env::{End, Env, Outcome};
use crate::error::Result;
use crate::layout::{Holds, Layout, Span};
use crate::seed::stream;
use rand::RngExt;
use std::sync::Arc;

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
/// What its rows hold: the two numbers, and their commands.
pub fn layout() -> Arc<Layout> {
    let span = |name: &str, holds| Span { name: name.into(), holds, entries: vec![format!("{name}.0"), format!("{name}.1")] };
    let (state, action) = (vec![span("x", Holds::Numbers)], vec![span("u", Holds::Commands)]);
    let (name, action_limits) = ("regulator".into(), vec![1.0; 2]);
    Arc::new(Layout { name, period_s: 0.05, state, action, action_limits, action_units: vec![], aims: vec![], arm: None })
}

impl Regulator {
    /// Whose starts come from this seed.
    pub fn new(seed: u64) -> Self {
        Regulator { seed, x: [0.0; 2], left: 0 }
    }

    fn show(&self, observation: &mut [f32]) {
        observation.copy_from_slice(&self.x);
    }
}

impl Env for Regulator {
    fn observation_len(&self) -> usize {
        2
    }

    fn action_len(&self) -> usize {
        2
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

/// Demos of a controller that is not the best, each of so many steps.
pub fn demos(count: u64, steps: usize) -> Vec<Demo> {
    let demo = |episode| {
        let mut world = Regulator::new(5);
        let (mut seen, mut states, mut actions) = ([0.0; 2], Vec::new(), Vec::new());
        world.reset(episode, &mut seen).expect("a start");
        world.left = u32::MAX;
        states.extend(seen);
        for t in 0..steps {
            let action = seen.map(|x| if t % 2 == 0 { 0.2 } else { -0.3 } - 0.4 * x);
            world.step(&action, &mut seen);
            actions.extend(action);
            states.extend(seen);
        }
        Demo::new(&layout(), states, actions.clone(), actions).expect("lengths match")
    };
    (0..count).map(demo).collect()
}

/// Mean discounted cost of a controller from some starts, over so many steps that the rest counts for nothing.
pub fn cost(mut control: impl FnMut(&[f32]) -> [f32; 2]) -> f64 {
    let mut world = Regulator::new(12);
    let mut seen = [0.0; 2];
    let mut total = 0.0;
    for episode in 0..20 {
        world.reset(episode, &mut seen).expect("a start");
        world.left = u32::MAX;
        let mut weight = 1.0;
        for _ in 0..100 {
            let action = control(&seen);
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
