//! An episode of `hilt simulate`: a plan, followed with the noise of a seed.

use super::{Disturbance, Follower, run_episode};
use crate::config::SimulateSettings;
use crate::demo::Episode;
use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::plan::Plan;
use crate::seed::stream;

/// Executes a plan by its follower with the noise of a seed.
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub fn execute(plan: &Plan, mut follower: Follower, of: &SimulateSettings, seed: u64, interrupt: &Interrupt) -> Result<Episode> {
    let mut disturbance = Disturbance::new(&plan.scene.robot, of, stream(seed, "simulate.noise", plan.index));
    run_episode(plan.index, &plan.scene, &mut follower, &mut disturbance, of.max_steps, interrupt)
}
