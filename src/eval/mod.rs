//! Seeded rollouts of a controller: success with its interval, conditions by name, failure classes.
//!
//! Scenes come from the random stream `evaluate.scene`, noise from `evaluate.noise`. Demonstrations are drawn from `plan.scene` and
//! `simulate.noise`: the stage's name is part of a stream, so that no evaluation episode repeats a demonstration, whatever the seeds.

mod log;
mod policy;
mod summary;
mod wilson;

pub use log::to_table;
pub use policy::PolicyController;
pub use summary::{Percentiles, Summary};
pub use wilson::wilson_95;

use crate::config::{Pipeline, PulseSettings, SimulateSettings};
use crate::demo::Episode;
use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::scene::Scene;
use crate::seed;
use crate::sim::{Controller, Disturbance, run_episode};
use crate::tasks::{FailureClass, draw_scene};
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
    fn of(episode: &Episode) -> Self {
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

/// What to evaluate on.
#[derive(Clone, Copy, Debug)]
pub struct Rollouts<'a> {
    /// Scene, noise and number of episodes.
    pub pipeline: &'a Pipeline,
    /// The run's seed.
    pub seed: u64,
    /// Control steps before an episode is given up.
    pub horizon_steps: u32,
}

impl Rollouts<'_> {
    /// The scene of episode `index`.
    ///
    /// # Errors
    /// See [`draw_scene`].
    pub fn scene(&self, index: u64) -> Result<Scene> {
        draw_scene(self.pipeline.task, &self.pipeline.scene, &mut seed::stream(self.seed, "evaluate.scene", index))
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
        let settings = self.disturbances();
        (0..self.pipeline.evaluate.episodes)
            .into_par_iter()
            .map(|index| {
                interrupt.check()?;
                let scene = self.scene(index)?;
                let episode = make_controller(index, &scene)?.map(|mut controller| {
                    let mut disturbance = Disturbance::new(&settings, seed::stream(self.seed, "evaluate.noise", index));
                    run_episode(index, &scene, controller.as_mut(), &mut disturbance, self.horizon_steps)
                });
                done(episode.as_ref())?;
                Ok(episode.map_or_else(|| unplanned(index, scene), |episode| Trial::of(&episode)))
            })
            .collect()
    }

    /// The noise of the demonstrations, without their pulses unless `evaluate.pulses` asks for them.
    fn disturbances(&self) -> SimulateSettings {
        let mut settings = self.pipeline.simulate.clone();
        if !self.pipeline.evaluate.pulses {
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
