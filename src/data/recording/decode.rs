//! From the messages of `proto/hilt.proto` back to an episode. Every error says which message and field.

use super::moment::{Moment, fixed, pose};
use super::older;
use super::topics::{OUTCOME_TOPIC, ROBOT_NAME, SCENE_TOPIC, STEP_TOPIC, TASK_NAME};
use super::walk::Outline;
use crate::config::{self, check_scene};
use crate::data::{json_text, proto};
use crate::demo::{Body, Contacts, Episode, Phase, Step, Touch};
use crate::joints::Joints;
use crate::robot::Robot;
use crate::robot::file::built_in::paper_robot;
use crate::scene::{OWN_FRICTION, Obstacle, Placed, Scene};
use crate::state::State;
use crate::task::{FailureClass, Task, built_in};
use prost::Message;
use serde::de::DeserializeOwned;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Most control steps of a recording: twice the longest demonstration that settings allow, which is the horizon of its policy.
const MOST_STEPS: usize = config::MOST_HORIZON_STEPS as usize;
/// Most bytes of a message that is read; a step has some 700, a scene 60 for every obstacle.
const MOST_MESSAGE_BYTES: usize = 64 << 10;

/// Most bytes of a robot or a task that is read; the robot of the paper has 5,000.
const MOST_ATTACHED_BYTES: usize = 1 << 20;

/// The messages seen so far.
struct Seen {
    robot: Arc<Robot>,
    /// The task that is attached; older files name one of those that there were.
    task: Option<Arc<Task>>,
    conditions: Vec<String>,
    scene: Option<Scene>,
    outcome: Option<proto::Outcome>,
    steps: Vec<Step>,
    /// Whether the last step is the final state.
    ended: bool,
}

/// The episode in a whole file.
pub(super) fn episode(outline: &Outline) -> Result<Episode, String> {
    let (robot, task) = (robot(outline)?, task(outline)?);
    let conditions = Vec::new();
    let mut seen = Seen { robot, task, conditions, scene: None, outcome: None, steps: Vec::new(), ended: false };
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
            SCENE_TOPIC => {
                let scene = scene(&self.robot, self.task.as_ref(), parse(topic, data)?)?;
                self.conditions = scene.task.condition_names();
                self.scene = Some(scene);
            }
            OUTCOME_TOPIC => self.outcome = Some(parse(topic, data)?),
            _ => {
                let scene = self.scene.as_ref().ok_or_else(|| missing(SCENE_TOPIC))?;
                let (message, t) = (parse::<proto::Step>(topic, data)?, self.steps.len());
                if t > MOST_STEPS {
                    return Err(format!("has more than {MOST_STEPS} steps, the most of an episode"));
                }
                self.ended = message.final_state;
                self.steps.push(step(message, t, scene, &self.conditions)?);
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
    let Some(robot) = attached::<Robot>(outline, ROBOT_NAME)? else { return Ok(paper_robot()) };
    robot.check().map_err(|why| format!("{ROBOT_NAME} cannot be: {why}"))?;
    Ok(Arc::new(robot))
}

/// What was to be done, where that is attached.
fn task(outline: &Outline) -> Result<Option<Arc<Task>>, String> {
    attached(outline, TASK_NAME).map(|task| task.map(Arc::new))
}

fn attached<T: DeserializeOwned>(outline: &Outline, name: &str) -> Result<Option<T>, String> {
    let Some(bytes) = outline.attachments.get(name) else { return Ok(None) };
    if bytes.len() > MOST_ATTACHED_BYTES {
        return Err(format!("{name} has {} bytes, at most {MOST_ATTACHED_BYTES} are read", bytes.len()));
    }
    json_text::parse(bytes).map(Some).map_err(|e| format!("{name} cannot be read: {e}"))
}

fn scene(robot: &Arc<Robot>, task: Option<&Arc<Task>>, message: proto::Scene) -> Result<Scene, String> {
    let obstacle = |o: &proto::Obstacle| {
        Ok(Obstacle { center_m: fixed("obstacle.center_m", &o.center_m)?, size_m: fixed("obstacle.size_m", &o.size_m)? })
    };
    let obstacles = message.obstacles.iter().map(obstacle).collect::<Result<_, String>>()?;
    let scene = match task {
        Some(task) if task.name != message.task => {
            return Err(format!("its scene is of {}, {TASK_NAME} of {task}", message.task));
        }
        Some(task) => {
            let (robot, task) = (Arc::clone(robot), Arc::clone(task));
            let placed = |placed: &proto::Placed| {
                let (friction, mass_kg) = (placed.friction, placed.mass_kg);
                Ok(Placed { pose: pose(&placed.name, placed.pose.as_ref())?, friction, mass_kg })
            };
            let names = message.objects.iter().map(|placed| &placed.name);
            if !names.clone().eq(task.objects.iter().map(|object| &object.name)) {
                return Err(format!("its scene has the objects {:?}, which are not those of {task}", names.collect::<Vec<_>>()));
            }
            let objects = message.objects.iter().map(placed).collect::<Result<_, String>>()?;
            let (goals, finger_friction) = (points(&message.goals)?, message.finger_friction.unwrap_or(OWN_FRICTION));
            Scene { robot, task, objects, goals, obstacles, finger_friction }
        }
        None => older::scene(robot, &built_in::find(&message.task)?, &message, obstacles)?,
    };
    check_scene(&scene).map_err(|why| format!("its scene cannot be: {why}"))?;
    Ok(scene)
}

fn step(message: proto::Step, t: usize, scene: &Scene, conditions: &[String]) -> Result<Step, String> {
    if message.step != t as u64 {
        return Err(format!("step {} stands where step {t} belongs", message.step));
    }
    let (task, robot) = (&scene.task, &*scene.robot);
    let joints = |name: &str, values: &[f64]| exactly(name, values, robot.joints.len());
    let names: Vec<&str> = message.conditions.iter().map(|c| c.name.as_str()).collect();
    if names != conditions {
        return Err(format!("step {t} has the conditions {names:?}, {task} has {conditions:?}"));
    }
    let found = if message.block.is_some() { older::moment(&message, scene)? } else { moment(&message, scene)? };
    let counts = [found.seen.len(), found.objects.len(), found.touches.len()];
    if counts != [task.objects.len(); 3] || found.goals.len() != scene.goals.len() {
        return Err(format!("step {t} has the goal, base block or objects of another task than {task}"));
    }
    let state = State {
        q: joints("q_rad", &message.q_rad)?,
        dq: joints("dq_rad_s", &message.dq_rad_s)?,
        objects: found.seen,
        goals: found.goals,
    };
    let contacts = message.contacts.as_ref().ok_or("contacts are missing")?;
    let touches = found.touches.into_iter().map(|found| touch(&found, robot.fingers().len(), task.objects.len()));
    Ok(Step {
        state,
        objects: found.objects,
        commanded: joints("commanded_rad_s", &message.commanded_rad_s)?,
        executed: joints("executed_rad_s", &message.executed_rad_s)?,
        contacts: Contacts {
            objects: touches.collect::<Result<_, _>>()?,
            robot_obstacle: contacts.robot_obstacle,
            robot_table: contacts.robot_table,
        },
        reward: message.reward,
        conditions: message.conditions.iter().map(|c| c.holds).collect(),
        phase: phase(message.phase)?,
    })
}

/// What goals move is seen as it is now, the rest as the scene has it.
fn moment(message: &proto::Step, scene: &Scene) -> Result<Moment, String> {
    let body = |body: &proto::Body| Ok(Body { pose: pose("an object", body.pose.as_ref())?, speed_m_s: body.speed_m_s });
    let objects = message.objects.iter().map(body).collect::<Result<Vec<Body>, String>>()?;
    let moved = objects.iter().take(scene.task.moved()).map(|object| object.pose);
    Ok(Moment {
        seen: moved.chain(scene.objects.iter().skip(scene.task.moved()).map(|object| object.pose)).collect(),
        goals: scene.goals.clone(),
        objects,
        touches: message.contacts.as_ref().map_or_else(Vec::new, |contacts| contacts.objects.clone()),
    })
}

fn touch(message: &proto::Touch, fingers: usize, objects: usize) -> Result<Touch, String> {
    let touched = message.objects.iter().map(|object| *object as usize).collect::<BTreeSet<usize>>();
    if let Some(unknown) = touched.iter().find(|object| **object >= objects) {
        return Err(format!("an object touches object {unknown}, of {objects}"));
    }
    Ok(Touch { fingers_n: exactly("fingers_n", &message.fingers_n, fingers)?, table: message.table, objects: touched })
}

fn points(messages: &[proto::Point]) -> Result<Vec<[f64; 3]>, String> {
    messages.iter().map(|point| fixed("goal", &point.position_m)).collect()
}

/// A number for each of so many joints.
fn exactly(name: &str, values: &[f64], expected: usize) -> Result<Joints, String> {
    let fits = Joints::of(values).filter(|joints| joints.len() == expected);
    fits.ok_or_else(|| format!("{name} has {} numbers, expected {expected}", values.len()))
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
