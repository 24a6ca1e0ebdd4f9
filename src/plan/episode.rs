//! An episode of `hilt plan`: its scene and its plan, by seed and number.

use super::{Plan, PlanError, Planner};
use crate::config::Pipeline;
use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::seed::stream;
use crate::tasks::draw_scene;

/// The plan of an episode of a seed, or why there is none.
///
/// # Errors
/// [`crate::error::Error::Usage`] when there is no room for the scene; [`crate::error::Error::Interrupted`].
pub fn plan_episode(
    planner: &mut Planner,
    of: &Pipeline,
    (seed, episode): (u64, u64),
    interrupt: &Interrupt,
) -> Result<std::result::Result<Plan, PlanError>> {
    interrupt.check()?;
    let scene = draw_scene(&of.robot, &of.task, &of.scene, &mut stream(seed, "plan.scene", episode))?;
    let plan = planner.plan(episode, &scene, &mut stream(seed, "plan.search", episode));
    interrupt.check()?;
    Ok(plan)
}
