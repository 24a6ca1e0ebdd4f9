//! From the messages of `proto/hilt.proto` back to an episode. Every error says which message and field.

use super::topics::{OUTCOME_TOPIC, ROBOT_NAME, SCENE_TOPIC, STEP_TOPIC};
use super::walk::Outline;
use crate::config::{self, check_scene};
use crate::data::proto;
use crate::demo::{Contacts, Episode, Phase, Step};
use crate::joints::Joints;
use crate::robot::Robot;
use crate::robot::file::built_in::paper_robot;
use crate::scene::{Obstacle, Scene};
use crate::state::{Context, Pose, State};
use crate::task::FailureClass;
use prost::Message;
use std::mem::discriminant;
use std::sync::Arc;

/// Most control steps of a recording: twice the longest demonstration that settings allow, which is the horizon of its policy.
const MOST_STEPS: usize = 2 * config::MOST_STEPS as usize;
/// Most bytes of a message that is read; a step has some 700, a scene 60 for every obstacle.
const MOST_MESSAGE_BYTES: usize = 64 << 10;

/// Most bytes of a robot that is read; that of the paper has 5,000.
const MOST_ROBOT_BYTES: usize = 1 << 20;

/// The messages seen so far.
struct Seen {
    robot: Arc<Robot>,
    scene: Option<Scene>,
    outcome: Option<proto::Outcome>,
    steps: Vec<Step>,
    /// Whether the last step is the final state.
    ended: bool,
}

/// The episode in a whole file.
pub(super) fn episode(outline: &Outline) -> Result<Episode, String> {
    let robot = robot(outline)?;
    let mut seen = Seen { robot, scene: None, outcome: None, steps: Vec::new(), ended: false };
    outline.messages(&mut |topic, data| seen.take(topic, data))?;
    let scene = seen.scene.ok_or_else(|| missing(SCENE_TOPIC))?;
    let outcome = seen.outcome.ok_or_else(|| missing(OUTCOME_TOPIC))?;
    let mut steps = seen.steps;
    if !seen.ended || outcome.steps.checked_add(1) != Some(steps.len() as u64) {
        let found = steps.len();
        return Err(format!("{OUTCOME_TOPIC} says {} steps and a final state, {STEP_TOPIC} has {found} messages", outcome.steps));
    }
    let last = steps.pop().ok_or_else(|| missing(STEP_TOPIC))?;
    let failure = failure(&outcome.failure)?;
    Ok(Episode { index: outcome.episode, scene, steps, last, success: outcome.success, failure })
}

impl Seen {
    fn take(&mut self, topic: &str, data: &[u8]) -> Result<(), String> {
        if ![SCENE_TOPIC, STEP_TOPIC, OUTCOME_TOPIC].contains(&topic) {
            return Ok(());
        }
        if data.len() > MOST_MESSAGE_BYTES {
            return Err(format!("a message on {topic} has {} bytes, at most {MOST_MESSAGE_BYTES} are read", data.len()));
        }
        match topic {
            SCENE_TOPIC => self.scene = Some(scene(&self.robot, parse(topic, data)?)?),
            OUTCOME_TOPIC => self.outcome = Some(parse(topic, data)?),
            _ => {
                let scene = self.scene.as_ref().ok_or_else(|| missing(SCENE_TOPIC))?;
                let (message, t) = (parse::<proto::Step>(topic, data)?, self.steps.len());
                if t > MOST_STEPS {
                    return Err(format!("has more than {MOST_STEPS} steps, the most of an episode"));
                }
                self.ended = message.final_state;
                let step = step(message, t, scene)?;
                if discriminant(&step.state.context) != discriminant(&scene.context) {
                    return Err(format!("step {t} has the goal or base block of another task than {}", scene.task));
                }
                self.steps.push(step);
            }
        }
        Ok(())
    }
}

fn missing(topic: &str) -> String {
    format!("holds no message on {topic}: not a recording of hilt simulate")
}

fn parse<M: Message + Default>(topic: &str, data: &[u8]) -> Result<M, String> {
    M::decode(data).map_err(|e| format!("a message on {topic} cannot be decoded: {e}"))
}

/// Who acted; a recording that does not say is of the paper's robot, when there was no other.
fn robot(outline: &Outline) -> Result<Arc<Robot>, String> {
    let Some(bytes) = outline.attachments.get(ROBOT_NAME) else { return Ok(paper_robot()) };
    if bytes.len() > MOST_ROBOT_BYTES {
        return Err(format!("{ROBOT_NAME} has {} bytes, at most {MOST_ROBOT_BYTES} are read", bytes.len()));
    }
    let robot: Robot = serde_json::from_slice(bytes).map_err(|e| format!("{ROBOT_NAME} cannot be read: {e}"))?;
    robot.check().map_err(|why| format!("{ROBOT_NAME} cannot be: {why}"))?;
    Ok(Arc::new(robot))
}

fn scene(robot: &Arc<Robot>, message: proto::Scene) -> Result<Scene, String> {
    let obstacle = |o: &proto::Obstacle| {
        Ok(Obstacle { center_m: fixed("obstacle.center_m", &o.center_m)?, size_m: fixed("obstacle.size_m", &o.size_m)? })
    };
    let scene = Scene {
        robot: Arc::clone(robot),
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

fn step(message: proto::Step, t: usize, scene: &Scene) -> Result<Step, String> {
    if message.step != t as u64 {
        return Err(format!("step {} stands where step {t} belongs", message.step));
    }
    let (task, robot) = (scene.task, &*scene.robot);
    let joints = |name: &str, values: &[f64]| exactly(name, values, robot.joints.len());
    let names: Vec<&str> = message.conditions.iter().map(|c| c.name.as_str()).collect();
    if names != task.condition_names() {
        return Err(format!("step {t} has the conditions {names:?}, {task} has {:?}", task.condition_names()));
    }
    let state = State {
        q: joints("q_rad", &message.q_rad)?,
        dq: joints("dq_rad_s", &message.dq_rad_s)?,
        block: pose("block", message.block.as_ref())?,
        context: context(message.context.as_ref())?,
    };
    let base_now = message.base_now.as_ref().map(|base| pose("base_now", Some(base))).transpose()?;
    Ok(Step {
        state,
        base_now,
        commanded: joints("commanded_rad_s", &message.commanded_rad_s)?,
        executed: joints("executed_rad_s", &message.executed_rad_s)?,
        contacts: contacts(message.contacts.as_ref(), robot.fingers().len())?,
        block_speed_m_s: message.block_speed_m_s,
        reward: message.reward,
        conditions: message.conditions.iter().map(|c| c.holds).collect(),
        phase: phase(message.phase)?,
    })
}

/// A number for each of so many joints.
fn exactly(name: &str, values: &[f64], expected: usize) -> Result<Joints, String> {
    let fits = Joints::of(values).filter(|joints| joints.len() == expected);
    fits.ok_or_else(|| format!("{name} has {} numbers, expected {expected}", values.len()))
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

fn contacts(message: Option<&proto::Contacts>, fingers: usize) -> Result<Contacts, String> {
    let message = message.ok_or("contacts are missing")?;
    Ok(Contacts {
        finger_block_n: exactly("finger_block_n", &message.finger_block_n, fingers)?,
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
