//! The simulated scene of a task as a world to learn in.

use super::disturbance::Disturbance;
use super::episode::{fallen, sound};
use super::world::World;
use crate::config::{Pipeline, PulseSettings, RewardKind, SceneSettings, SimulateSettings};
use crate::env::{End, Env, Outcome};
use crate::error::{Error, Result};
use crate::guard::guarded;
use crate::joints::Joints;
use crate::robot::Robot;
use crate::scene::Scene;
use crate::seed::stream;
use crate::tasks::{Monitor, Observation, Task, dense, draw_scene};
use std::sync::Arc;

/// A task in contact physics. Scenes come from the random stream `train.ppo.scene`, the noise on the commands from `train.ppo.noise`: no
/// demonstration, selection or evaluation has them. There are no pulses, as in an evaluation.
pub struct TaskEnv {
    robot: Arc<Robot>,
    task: Arc<Task>,
    observation_len: usize,
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
    /// As `[scene]`, `[simulate]` and gamma of `[train.ppo]` have it; episodes are cut off after `horizon_steps`.
    pub fn new(pipeline: &Pipeline, reward: RewardKind, horizon_steps: u32, seed: u64) -> Self {
        let robot = &pipeline.robot;
        let pulses = PulseSettings { probability: 0.0, ..pipeline.simulate.pulses.clone() };
        TaskEnv {
            robot: Arc::clone(robot),
            task: Arc::clone(&pipeline.task),
            observation_len: pipeline.task.layout(robot).state_dim(),
            scene: pipeline.scene.clone(),
            noise: SimulateSettings { pulses, ..pipeline.simulate.clone() },
            reward,
            gamma: pipeline.train.ppo.gamma,
            horizon_steps,
            seed,
            running: None,
        }
    }
}

impl Env for TaskEnv {
    fn observation_len(&self) -> usize {
        self.observation_len
    }

    fn action_len(&self) -> usize {
        self.robot.joints.len()
    }

    fn reset(&mut self, episode: u64, observation: &mut [f32]) -> Result<()> {
        let scene = draw_scene(&self.robot, &self.task, &self.scene, &mut stream(self.seed, "train.ppo.scene", episode))?;
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
        let disturbance = Disturbance::new(&self.robot, &self.noise, stream(self.seed, "train.ppo.noise", episode));
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
        let over = verdict.success || fallen(&seen.objects);
        let cut = running.steps >= self.horizon_steps;
        let end = if over { Some(End::Terminated) } else { cut.then_some(End::Truncated) };
        Outcome { reward: reward as f32, end, success: verdict.success }
    }
}

impl Running {
    /// One control step; `None` when the simulation breaks down.
    fn step(&mut self, action: &[f32]) -> Option<Observation> {
        self.steps += 1;
        let commanded: Joints = action.iter().map(|v| f64::from(*v)).collect();
        let executed = self.disturbance.apply(&commanded);
        let seen = guarded(|| {
            self.world.step(&executed);
            self.world.observe()
        });
        seen.ok().filter(sound)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::Planner;
    use crate::scene::Obstacle;
    use crate::sim::{Controller, Follower};
    use crate::task::built_in::pick_up;

    fn env(change: impl Fn(&mut Pipeline)) -> TaskEnv {
        let mut pipeline = Pipeline::defaults(&pick_up());
        change(&mut pipeline);
        TaskEnv::new(&pipeline, pipeline.train.ppo.reward, pipeline.train.ppo.horizon_steps, 11)
    }

    fn begin(env: &mut TaskEnv, episode: u64) -> Vec<f32> {
        let mut seen = vec![0.0; env.observation_len()];
        env.reset(episode, &mut seen).expect("an episode");
        seen
    }

    #[test]
    fn an_episode_comes_back_by_its_actions_and_is_cut_at_the_horizon() {
        let mut env = env(|pipeline| pipeline.train.ppo.horizon_steps = 15);
        let mut run = |episode: u64| {
            let (mut seen, mut all) = (begin(&mut env, episode), Vec::new());
            loop {
                let action: Vec<f32> = (0..9).map(|i| 0.1 * ((all.len() + i) % 7) as f32 - 0.3).collect();
                let outcome = env.step(&action, &mut seen);
                all.push((seen.clone(), outcome));
                if outcome.end.is_some() {
                    return all;
                }
            }
        };
        let first = run(3);
        assert_eq!((first.len(), first[14].1.end), (15, Some(End::Truncated)));
        assert_ne!(run(4), first);
        assert_eq!(run(3), first);
    }

    /// Sum of the rewards of the demonstrator's episode, and the last of them.
    fn demonstrated(reward: RewardKind) -> (f64, f64) {
        let mut env = env(|pipeline| pipeline.train.ppo.reward = reward);
        let mut seen = begin(&mut env, 0);
        let scene = env.running.as_ref().expect("begun").scene.clone();
        let plan = Planner::new(&scene.robot, &scene.task, &Pipeline::defaults(&pick_up()).plan).plan(
            0,
            &scene,
            &mut stream(0, "env test", 0),
        );
        let mut follower = Follower::new(&plan.expect("a plan")).expect("a follower");
        let mut sum = 0.0;
        loop {
            let now = env.running.as_mut().expect("begun").world.observe();
            let outcome = env.step(&follower.command(&now).iter().map(|v| *v as f32).collect::<Vec<f32>>(), &mut seen);
            sum += f64::from(outcome.reward);
            if let Some(end) = outcome.end {
                assert!(outcome.success && end == End::Terminated, "the demonstrator fails");
                return (sum, f64::from(outcome.reward));
            }
            assert!((0.0..=1.0).contains(&outcome.reward), "{outcome:?}");
        }
    }

    #[test]
    fn the_demonstrator_earns_every_milestone_and_the_densest_reward_at_the_end() {
        let (milestones, _) = demonstrated(RewardKind::Staged);
        assert!((milestones - 1.11).abs() < 1e-6, "{milestones}");
        let (_, last) = demonstrated(RewardKind::Dense);
        let gamma = Pipeline::defaults(&pick_up()).train.ppo.gamma;
        assert!((last - 1.0 - 1.0 / (1.0 - gamma)).abs() < 1e-4, "{last}");
    }

    #[test]
    fn a_simulation_that_breaks_down_ends_the_episode() {
        let mut wall = env(|pipeline| {
            pipeline.scene.obstacles = vec![Obstacle { center_m: [0.0, 0.0, 0.3], size_m: [0.02; 3] }];
        });
        let mut seen = begin(&mut wall, 0);
        let ends = (0..20).find_map(|_| {
            let outcome = wall.step(&[0.0; 9], &mut seen);
            outcome.end.map(|end| (end, outcome.reward, outcome.success))
        });
        assert_eq!(ends, Some((End::Terminated, 0.0, false)));
        assert!(seen.iter().all(|v| v.is_finite()));
    }
}
