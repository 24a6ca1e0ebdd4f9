//! The simulated scene of a task as a world to learn in.

use super::disturbance::Disturbance;
use super::episode::{fallen, sound};
use super::world::World;
use crate::config::{Pipeline, PulseSettings, RewardKind, SceneSettings, SimulateSettings};
use crate::env::{End, Env, Outcome};
use crate::error::{Error, Result};
use crate::guard::guarded;
use crate::scene::Scene;
use crate::seed::stream;
use crate::state::JOINTS;
use crate::tasks::{Monitor, Observation, Task, dense, draw_scene};

/// A task in contact physics. Scenes come from the random stream `train.ppo.scene`, the noise on the commands from `train.ppo.noise`: no
/// demonstration, selection or evaluation has them. There are no pulses, as in an evaluation.
pub struct TaskEnv {
    task: Task,
    scene: SceneSettings,
    noise: SimulateSettings,
    reward: RewardKind,
    gamma: f64,
    horizon_steps: u32,
    seed: u64,
    running: Option<Running>,
}

/// The present episode.
struct Running {
    scene: Scene,
    world: World,
    monitor: Monitor,
    disturbance: Disturbance,
    steps: u32,
}

impl TaskEnv {
    /// As `[scene]`, `[simulate]` and `[train.ppo]` have it.
    pub fn new(pipeline: &Pipeline, seed: u64) -> Self {
        let ppo = &pipeline.train.ppo;
        let pulses = PulseSettings { probability: 0.0, ..pipeline.simulate.pulses.clone() };
        TaskEnv {
            task: pipeline.task,
            scene: pipeline.scene.clone(),
            noise: SimulateSettings { pulses, ..pipeline.simulate.clone() },
            reward: ppo.reward,
            gamma: ppo.gamma,
            horizon_steps: ppo.horizon_steps,
            seed,
            running: None,
        }
    }
}

impl Env for TaskEnv {
    fn observation_len(&self) -> usize {
        self.task.state_dim()
    }

    fn action_len(&self) -> usize {
        JOINTS
    }

    fn reset(&mut self, episode: u64, observation: &mut [f32]) -> Result<()> {
        let scene = draw_scene(self.task, &self.scene, &mut stream(self.seed, "train.ppo.scene", episode))?;
        let begun = guarded(|| {
            let mut world = World::new(&scene);
            let first = world.observe();
            (world, first)
        });
        let Some((world, first)) = begun.ok().filter(|(_, first)| sound(first)) else {
            let why = "the simulation breaks down before the first step: look at scene.obstacles and scene.block_mass_kg";
            return Err(Error::Failed(format!("episode {episode} of the training: {why}")));
        };
        let mut monitor = Monitor::new(&scene);
        monitor.update(&first);
        observation.copy_from_slice(&first.state.to_row());
        let disturbance = Disturbance::new(&self.noise, stream(self.seed, "train.ppo.noise", episode));
        self.running = Some(Running { scene, world, monitor, disturbance, steps: 0 });
        Ok(())
    }

    fn step(&mut self, action: &[f32], observation: &mut [f32]) -> Outcome {
        let running = self.running.as_mut().expect("an episode has begun");
        let Some(seen) = running.step(action) else {
            return Outcome { reward: 0.0, end: Some(End::Terminated), success: false };
        };
        observation.copy_from_slice(&seen.state.to_row());
        let verdict = running.monitor.update(&seen);
        let reward = match self.reward {
            RewardKind::Staged => verdict.reward,
            RewardKind::Dense => dense(&running.scene, &seen, &verdict, self.gamma),
        };
        let over = verdict.success || fallen(&seen);
        let cut = running.steps >= self.horizon_steps;
        let end = if over { Some(End::Terminated) } else { cut.then_some(End::Truncated) };
        Outcome { reward: reward as f32, end, success: verdict.success }
    }
}

impl Running {
    /// One control step; `None` when the simulation breaks down.
    fn step(&mut self, action: &[f32]) -> Option<Observation> {
        self.steps += 1;
        let commanded = std::array::from_fn(|i| f64::from(action[i]));
        let executed = self.disturbance.apply(&commanded);
        let seen = guarded(|| {
            self.world.step(&executed);
            self.world.observe()
        });
        seen.ok().filter(sound)
    }
}
