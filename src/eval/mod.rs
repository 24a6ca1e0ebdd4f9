//! Seeded rollouts of a controller: success with its interval, conditions by name, failure classes.
//!
//! Scenes come from the random stream `evaluate.scene`, noise from `evaluate.noise`; the rollouts that select a model have
//! `select.scene` and `select.noise`. Demonstrations are drawn from `plan.scene` and `simulate.noise`: the purpose is part of a
//! stream's name, so that no evaluation episode repeats a demonstration or had a say in the selection, whatever the seeds.

mod log;
mod policy;
mod rate_difference;
mod replay;
mod summary;
mod wilson;

pub use log::to_table;
pub use policy::PolicyController;
pub use rate_difference::{Pairs, newcombe_95};
pub use replay::{Moment, Replay};
pub use summary::{Percentiles, Summary};
pub use wilson::wilson_95;

use crate::config::{EvaluateSettings, Pipeline, PulseSettings, SimulateSettings};
use crate::demo::Episode;
use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::scene::Scene;
use crate::seed;
use crate::sim::{Controller, Disturbance, run_episode};
use crate::tasks::{FailureClass, draw_scene};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// How one evaluation episode went.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// Episode number.
    pub index: u64,
    /// Where it started.
    pub scene: Scene,
    /// Whether the task was solved.
    pub success: bool,
    /// Why not, if it was not.
    pub failure: Option<FailureClass>,
    /// Control steps taken.
    pub steps: u64,
    /// Sum of rewards.
    pub reward: f64,
    /// Which of `task.condition_names()` held at the end.
    pub conditions: Vec<bool>,
    /// Whether a robot link touched an obstacle at any moment.
    pub hit_obstacle: bool,
}

impl Trial {
    /// What is kept of an episode.
    pub fn of(episode: &Episode) -> Self {
        let moments = || episode.steps.iter().chain([&episode.last]);
        Trial {
            index: episode.index,
            scene: episode.scene.clone(),
            success: episode.success,
            failure: episode.failure,
            steps: episode.steps.len() as u64,
            reward: moments().map(|s| s.reward).sum(),
            conditions: episode.last.conditions.clone(),
            hit_obstacle: moments().any(|s| s.contacts.robot_obstacle),
        }
    }
}

/// What to roll out on.
#[derive(Clone, Copy, Debug)]
pub struct Rollouts<'a> {
    /// Scene and noise.
    pub pipeline: &'a Pipeline,
    /// The run's seed.
    pub seed: u64,
    /// What for: the first part of the random streams' names.
    purpose: &'static str,
    /// How many.
    pub episodes: u64,
    /// Whether the pulses of the demonstrations are among the noise.
    pulses: bool,
    /// Control steps before an episode is given up.
    pub horizon_steps: u32,
}

impl<'a> Rollouts<'a> {
    /// An evaluation, as `[evaluate]` has it.
    pub fn evaluation(pipeline: &'a Pipeline, seed: u64, horizon_steps: u32) -> Self {
        let EvaluateSettings { episodes, pulses, .. } = pipeline.evaluate;
        Rollouts { pipeline, seed, purpose: "evaluate", episodes, pulses, horizon_steps }
    }

    /// The choice among policies during training, as `[train]` has it; without pulses.
    pub fn selection(pipeline: &'a Pipeline, seed: u64, horizon_steps: u32) -> Self {
        Rollouts { pipeline, seed, purpose: "select", episodes: pipeline.train.select_episodes, pulses: false, horizon_steps }
    }

    /// Episodes for others to learn in: as an evaluation's, but none of them is one of an evaluation, a selection or a demonstration.
    pub fn training(pipeline: &'a Pipeline, seed: u64, horizon_steps: u32) -> Self {
        Rollouts { purpose: "environment", ..Rollouts::evaluation(pipeline, seed, horizon_steps) }
    }

    fn stream(&self, of: &str, index: u64) -> ChaCha8Rng {
        seed::stream(self.seed, &format!("{}.{of}", self.purpose), index)
    }

    /// The scene of episode `index`.
    ///
    /// # Errors
    /// See [`draw_scene`].
    pub fn scene(&self, index: u64) -> Result<Scene> {
        draw_scene(&self.pipeline.robot, &self.pipeline.task, &self.pipeline.scene, &mut self.stream("scene", index))
    }

    /// Runs all episodes, in parallel on the current thread pool; the result does not depend on the number of threads.
    ///
    /// `make_controller` gives each episode its own controller, from its number and scene; `None` (the demonstrator found no plan)
    /// counts as never reached, in zero steps. `done` is called once per finished episode, in no particular order, with what was recorded of it.
    ///
    /// # Errors
    /// The first error of a scene, a controller or of `done`; [`crate::error::Error::Interrupted`].
    pub fn run<F>(
        &self,
        make_controller: F,
        interrupt: &Interrupt,
        done: impl Fn(Option<&Episode>) -> Result<()> + Sync,
    ) -> Result<Vec<Trial>>
    where
        F: Fn(u64, &Scene) -> Result<Option<Box<dyn Controller>>> + Sync,
    {
        (0..self.episodes)
            .into_par_iter()
            .map(|index| {
                interrupt.check()?;
                let scene = self.scene(index)?;
                let run = |mut controller: Box<dyn Controller>| self.play(index, &scene, controller.as_mut(), interrupt);
                let episode = make_controller(index, &scene)?.map(run).transpose()?;
                done(episode.as_ref())?;
                Ok(episode.map_or_else(|| unplanned(index, scene), |episode| Trial::of(&episode)))
            })
            .collect()
    }

    /// Runs episode `index`, in its scene.
    ///
    /// # Errors
    /// [`crate::error::Error::Interrupted`].
    pub fn play(&self, index: u64, scene: &Scene, controller: &mut dyn Controller, interrupt: &Interrupt) -> Result<Episode> {
        let mut disturbance = Disturbance::new(&scene.robot, &self.disturbances(), self.stream("noise", index));
        run_episode(index, scene, controller, &mut disturbance, self.horizon_steps, interrupt)
    }

    /// The noise of the demonstrations, with or without their pulses.
    fn disturbances(&self) -> SimulateSettings {
        let mut settings = self.pipeline.simulate.clone();
        if !self.pulses {
            settings.pulses = PulseSettings { probability: 0.0, ..settings.pulses };
        }
        settings
    }
}

fn unplanned(index: u64, scene: Scene) -> Trial {
    let conditions = vec![false; scene.task.condition_names().len()];
    let failure = Some(FailureClass::NeverReached);
    Trial { index, scene, success: false, failure, steps: 0, reward: 0.0, conditions, hit_obstacle: false }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Obstacle;
    use crate::state::Action;
    use crate::task::built_in::{pick_up, stack};
    use crate::tasks::Observation;

    #[test]
    fn selection_and_evaluation_share_no_episode() {
        let mut pipeline = Pipeline::defaults(&stack());
        pipeline.train.select_episodes = 20;
        let (select, evaluate) = (Rollouts::selection(&pipeline, 3, 10), Rollouts::evaluation(&pipeline, 3, 10));
        assert_eq!((select.episodes, evaluate.episodes), (20, pipeline.evaluate.episodes));
        let scenes =
            |of: &Rollouts| (0..20).map(|i| of.scene(i).expect("a scene").objects[0].pose.position_m).collect::<Vec<_>>();
        let (selecting, evaluating) = (scenes(&select), scenes(&evaluate));
        assert!(selecting.iter().all(|scene| !evaluating.contains(scene)));
        let noise = |of: &Rollouts| of.stream("noise", 0).get_stream();
        assert_ne!(noise(&select), noise(&evaluate));
    }

    /// Asks for this in every step.
    struct Constant(f64);

    impl Controller for Constant {
        fn command(&mut self, _seen: &Observation) -> Action {
            [self.0; 9].into()
        }
    }

    /// The rollouts of a selection too: training goes on with a count of 0 instead of ending without its checkpoint.
    #[test]
    fn rollouts_that_break_down_or_ask_for_no_number_are_counted_by_their_class() {
        let mut pipeline = Pipeline::defaults(&pick_up());
        pipeline.train.select_episodes = 3;
        let classes = |pipeline: &Pipeline, command: f64| {
            let make = |_, _: &Scene| Ok(Some(Box::new(Constant(command)) as Box<dyn Controller>));
            let trials = Rollouts::selection(pipeline, 3, 10).run(make, &Interrupt::default(), |_| Ok(()));
            Summary::of(&pick_up(), &trials.expect("no error")).failures
        };
        assert_eq!(classes(&pipeline, 0.0)["never_reached"], 3);
        assert_eq!(classes(&pipeline, f64::NAN)["command_not_finite"], 3);
        pipeline.scene.obstacles = vec![Obstacle { center_m: [0.0, 0.0, 0.3], size_m: [0.02; 3] }];
        assert_eq!(classes(&pipeline, 0.0)["simulation_broke_down"], 3);
    }
}
