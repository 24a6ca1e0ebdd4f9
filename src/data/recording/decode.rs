//! From the messages of `proto/hilt.proto` back to an episode. Every error says which message and field.

use super::walk::Outline;
use super::{OUTCOME_TOPIC, SCENE_TOPIC, STEP_TOPIC};
use crate::config::check_scene;
use crate::data::proto;
use crate::demo::{Contacts, Episode, Phase, Step};
use crate::scene::{Obstacle, Scene};
use crate::state::{Context, Pose, State};
use crate::tasks::{FailureClass, Task};
use prost::Message;

/// The episode in a whole file.
pub(super) fn episode(outline: &Outline) -> Result<Episode, String> {
    let (mut found_scene, mut found_outcome, mut steps) = (None, None, Vec::new());
    outline.messages(&mut |topic, data| {
        match topic {
            SCENE_TOPIC => found_scene = Some(scene(parse(SCENE_TOPIC, data)?)?),
            STEP_TOPIC => steps.push(parse::<proto::Step>(STEP_TOPIC, data)?),
            OUTCOME_TOPIC => found_outcome = Some(parse::<proto::Outcome>(OUTCOME_TOPIC, data)?),
            _ => {}
        }
        Ok(())
    })?;
    let scene = found_scene.ok_or_else(|| missing(SCENE_TOPIC))?;
    let outcome = found_outcome.ok_or_else(|| missing(OUTCOME_TOPIC))?;
    let count = steps.len() as u64;
    if !steps.last().is_some_and(|s| s.final_state) || outcome.steps + 1 != count {
        return Err(format!("{OUTCOME_TOPIC} says {} steps and a final state, {STEP_TOPIC} has {count} messages", outcome.steps));
    }
    let mut steps = steps.into_iter().enumerate().map(|(t, s)| step(s, t, scene.task)).collect::<Result<Vec<_>, _>>()?;
    let last = steps.pop().ok_or_else(|| missing(STEP_TOPIC))?;
    let failure = failure(&outcome.failure)?;
    Ok(Episode { index: outcome.episode, scene, steps, last, success: outcome.success, failure })
}

fn missing(topic: &str) -> String {
    format!("holds no message on {topic}: not a recording of hilt simulate")
}

fn parse<M: Message + Default>(topic: &str, data: &[u8]) -> Result<M, String> {
    M::decode(data).map_err(|e| format!("a message on {topic} cannot be decoded: {e}"))
}

fn scene(message: proto::Scene) -> Result<Scene, String> {
    let obstacle = |o: &proto::Obstacle| {
        Ok(Obstacle { center_m: fixed("obstacle.center_m", &o.center_m)?, size_m: fixed("obstacle.size_m", &o.size_m)? })
    };
    let scene = Scene {
        task: message.task.parse()?,
        block: pose("scene.block", message.block.as_ref())?,
        context: context(message.context.as_ref())?,
        obstacles: message.obstacles.iter().map(obstacle).collect::<Result<_, String>>()?,
        friction: message.friction,
        block_mass_kg: message.block_mass_kg,
    };
    check_scene(&scene).map_err(|why| format!("its scene cannot be: {why}"))?;
    Ok(scene)
}

fn step(message: proto::Step, t: usize, task: Task) -> Result<Step, String> {
    if message.step != t as u64 {
        return Err(format!("step {} stands where step {t} belongs", message.step));
    }
    let names: Vec<&str> = message.conditions.iter().map(|c| c.name.as_str()).collect();
    if names != task.condition_names() {
        return Err(format!("step {t} has the conditions {names:?}, {task} has {:?}", task.condition_names()));
    }
    let state = State {
        q_rad: fixed("q_rad", &message.q_rad)?,
        dq_rad_s: fixed("dq_rad_s", &message.dq_rad_s)?,
        block: pose("block", message.block.as_ref())?,
        context: context(message.context.as_ref())?,
    };
    let base_now = message.base_now.as_ref().map(|base| pose("base_now", Some(base))).transpose()?;
    Ok(Step {
        state,
        base_now,
        commanded: fixed("commanded_rad_s", &message.commanded_rad_s)?,
        executed: fixed("executed_rad_s", &message.executed_rad_s)?,
        contacts: contacts(message.contacts.as_ref())?,
        block_speed_m_s: message.block_speed_m_s,
        reward: message.reward,
        conditions: message.conditions.iter().map(|c| c.holds).collect(),
        phase: phase(message.phase)?,
    })
}

fn fixed<const N: usize>(name: &str, values: &[f64]) -> Result<[f64; N], String> {
    values.try_into().map_err(|_| format!("{name} has {} numbers, expected {N}", values.len()))
}

fn pose(name: &str, message: Option<&proto::Pose>) -> Result<Pose, String> {
    let message = message.ok_or_else(|| format!("{name} is missing"))?;
    Ok(Pose { position_m: fixed(name, &message.position_m)?, quaternion_xyzw: fixed(name, &message.quaternion_xyzw)? })
}

fn context(message: Option<&proto::Context>) -> Result<Context, String> {
    Ok(match message.and_then(|c| c.kind.as_ref()) {
        None => Context::None,
        Some(proto::context::Kind::Goal(goal)) => Context::Goal(fixed("goal", &goal.position_m)?),
        Some(proto::context::Kind::Base(base)) => Context::Base(pose("base", Some(base))?),
    })
}

fn contacts(message: Option<&proto::Contacts>) -> Result<Contacts, String> {
    let message = message.ok_or("contacts are missing")?;
    Ok(Contacts {
        finger_block_n: fixed("finger_block_n", &message.finger_block_n)?,
        block_table: message.block_table,
        block_base: message.block_base,
        robot_obstacle: message.robot_obstacle,
        robot_table: message.robot_table,
    })
}

fn phase(code: i32) -> Result<Option<Phase>, String> {
    let phase = proto::Phase::try_from(code).map_err(|_| format!("phase {code} is unknown"))?;
    Ok(match phase {
        proto::Phase::Unspecified => None,
        proto::Phase::Approach => Some(Phase::Approach),
        proto::Phase::Close => Some(Phase::Close),
        proto::Phase::Carry => Some(Phase::Carry),
        proto::Phase::Open => Some(Phase::Open),
        proto::Phase::Retreat => Some(Phase::Retreat),
    })
}

fn failure(name: &str) -> Result<Option<FailureClass>, String> {
    if name.is_empty() {
        return Ok(None);
    }
    let class = FailureClass::ALL.into_iter().find(|c| c.name() == name);
    class.map(Some).ok_or_else(|| format!("failure class \"{name}\" is unknown"))
}
