//! From a recorded moment on: the same episode with another controller or other noise.

use crate::config::{Pipeline, PulseSettings};
use crate::demo::Episode;
use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::joints::Joints;
use crate::scene::Scene;
use crate::seed;
use crate::sim::{Controller, Disturbance, run_episode_from};
use std::sync::Arc;

/// A moment of a recorded episode.
#[derive(Clone, Copy, Debug)]
pub struct Moment<'a> {
    /// The episode.
    pub recorded: &'a Episode,
    /// Before which of its steps.
    pub at: usize,
}

/// What happens from there on, beside the controller.
#[derive(Clone, Copy, Debug)]
pub struct Replay<'a> {
    /// Noise.
    pub pipeline: &'a Pipeline,
    /// Seed of the noise.
    pub seed: u64,
    /// What the noise's random stream is called: that of the recording, for the same noise.
    pub stream: &'a str,
    /// Whether there are pulses.
    pub pulses: bool,
    /// Control steps before the episode is given up, those before the moment too.
    pub horizon_steps: u32,
}

impl Moment<'_> {
    /// Names of the objects that fingers press on.
    pub fn held(&self) -> Vec<&str> {
        let (objects, step) = (&self.recorded.scene.task.objects, &self.recorded.steps[self.at]);
        let pressed = |forces: &Joints| forces.iter().any(|force| *force > 0.0);
        let held = objects.iter().zip(&step.contacts.objects).filter(|(_, touch)| pressed(&touch.fingers_n));
        held.map(|(object, _)| object.name.as_str()).collect()
    }

    /// The scene as a demonstrator finds it that begins here: the objects where they are, the arm's ready pose where the arm is. At the start of the
    /// episode it is the episode's own.
    pub fn scene(&self) -> Scene {
        let mut scene = self.recorded.scene.clone();
        if self.at == 0 {
            return scene;
        }
        let step = &self.recorded.steps[self.at];
        scene.objects.iter_mut().zip(&step.objects).for_each(|(object, now)| object.pose = now.pose);
        let mut robot = (*scene.robot).clone();
        let arm = robot.arm;
        robot.ready[..arm].copy_from_slice(&step.state.q[..arm]);
        scene.robot = Arc::new(robot);
        scene
    }
}

impl Replay<'_> {
    /// Runs it; returns how far the moment was from what was recorded, too ([`run_episode_from`]).
    ///
    /// # Errors
    /// [`crate::error::Error::Interrupted`].
    pub fn run(&self, from: Moment, controller: &mut dyn Controller, interrupt: &Interrupt) -> Result<(Episode, f64)> {
        let Moment { recorded, at } = from;
        let mut settings = self.pipeline.simulate.clone();
        if !self.pulses {
            settings.pulses = PulseSettings { probability: 0.0, ..settings.pulses };
        }
        let noise = seed::stream(self.seed, self.stream, recorded.index);
        let mut disturbance = Disturbance::new(&recorded.scene.robot, &settings, noise);
        run_episode_from(recorded, at, controller, &mut disturbance, self.horizon_steps, interrupt)
    }
}
