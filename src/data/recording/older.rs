//! Recordings from when a task had one block, and a goal or a base block.

use super::moment::{Moment, fixed, pose};
use crate::data::proto;
use crate::demo::Body;
use crate::robot::Robot;
use crate::scene::{Obstacle, OlderContext, Scene};
use crate::task::Task;
use std::sync::Arc;

/// What stood where at the start.
pub(super) fn scene(
    robot: &Arc<Robot>,
    task: &Arc<Task>,
    message: &proto::Scene,
    obstacles: Vec<Obstacle>,
) -> Result<Scene, String> {
    let block = pose("scene.block", message.block.as_ref())?;
    let context = context(message.context.as_ref())?;
    Ok(Scene::of_older(robot, task, (block, context), (message.friction, message.block_mass_kg), obstacles))
}

/// What a step says of block, goal and base block. Whether the base block stands on the table, and how fast it is, was not recorded.
pub(super) fn moment(message: &proto::Step, scene: &Scene) -> Result<Moment, String> {
    let block = pose("block", message.block.as_ref())?;
    let contacts = message.contacts.as_ref().ok_or("contacts are missing")?;
    let on_base = contacts.block_base;
    let (mut seen, mut goals) = (vec![block], Vec::new());
    let mut objects = vec![Body { pose: block, speed_m_s: message.block_speed_m_s }];
    let touched = if on_base { vec![1] } else { Vec::new() };
    let fingers_n = contacts.finger_block_n.clone();
    let mut touches = vec![proto::Touch { fingers_n, table: contacts.block_table, objects: touched }];
    match context(message.context.as_ref())? {
        OlderContext::None => {}
        OlderContext::Goal(goal) => goals.push(goal),
        OlderContext::Base(base) => {
            let now = message.base_now.as_ref().map(|now| pose("base_now", Some(now))).transpose()?.unwrap_or(base);
            seen.push(base);
            objects.push(Body { pose: now, speed_m_s: 0.0 });
            let touched = if on_base { vec![0] } else { Vec::new() };
            touches.push(proto::Touch { fingers_n: vec![0.0; scene.robot.fingers().len()], table: true, objects: touched });
        }
    }
    Ok(Moment { seen, goals, objects, touches })
}

fn context(message: Option<&proto::Context>) -> Result<OlderContext, String> {
    Ok(match message.and_then(|c| c.kind.as_ref()) {
        None => OlderContext::None,
        Some(proto::context::Kind::Goal(goal)) => OlderContext::Goal(fixed("goal", &goal.position_m)?),
        Some(proto::context::Kind::Base(base)) => OlderContext::Base(pose("base", Some(base))?),
    })
}
