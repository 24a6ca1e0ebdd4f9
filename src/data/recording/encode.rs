//! From an episode's own types to the messages of `proto/hilt.proto`.

use crate::data::proto;
use crate::demo::{Body, Contacts, Episode, Phase, Step, Touch};
use crate::scene::{OWN_FRICTION, Obstacle, Placed, Scene};
use crate::state::Pose;
use crate::task::{FailureClass, Object};

pub(super) fn step(step: &Step, conditions: &[String], number: usize, final_state: bool) -> proto::Step {
    let conditions = conditions.iter().zip(&step.conditions);
    proto::Step {
        step: number as u64,
        q_rad: step.state.q.to_vec(),
        dq_rad_s: step.state.dq.to_vec(),
        commanded_rad_s: step.commanded.to_vec(),
        executed_rad_s: step.executed.to_vec(),
        contacts: Some(contacts(&step.contacts)),
        reward: step.reward,
        conditions: conditions.map(|(name, holds)| proto::Condition { name: name.clone(), holds: *holds }).collect(),
        phase: phase(step.phase).into(),
        final_state,
        objects: step.objects.iter().map(body).collect(),
        ..proto::Step::default()
    }
}

pub(super) fn scene(scene: &Scene) -> proto::Scene {
    let placed = |(object, at): (&Object, &Placed)| proto::Placed {
        name: object.name.clone(),
        pose: Some(pose(&at.pose)),
        friction: at.friction,
        mass_kg: at.mass_kg,
    };
    let obstacle = |o: &Obstacle| proto::Obstacle { center_m: o.center_m.to_vec(), size_m: o.size_m.to_vec() };
    proto::Scene {
        task: scene.task.name.clone(),
        obstacles: scene.obstacles.iter().map(obstacle).collect(),
        objects: scene.task.objects.iter().zip(&scene.objects).map(placed).collect(),
        goals: scene.goals.iter().map(point).collect(),
        finger_friction: Some(scene.finger_friction).filter(|share| *share != OWN_FRICTION),
        ..proto::Scene::default()
    }
}

pub(super) fn outcome(episode: &Episode) -> proto::Outcome {
    proto::Outcome {
        episode: episode.index,
        steps: episode.steps.len() as u64,
        success: episode.success,
        failure: episode.failure.map_or("", FailureClass::name).into(),
    }
}

fn pose(pose: &Pose) -> proto::Pose {
    proto::Pose { position_m: pose.position_m.to_vec(), quaternion_xyzw: pose.quaternion_xyzw.to_vec() }
}

fn point(point: &[f64; 3]) -> proto::Point {
    proto::Point { position_m: point.to_vec() }
}

fn body(body: &Body) -> proto::Body {
    proto::Body { pose: Some(pose(&body.pose)), speed_m_s: body.speed_m_s }
}

fn contacts(contacts: &Contacts) -> proto::Contacts {
    let touch = |touch: &Touch| proto::Touch {
        fingers_n: touch.fingers_n.to_vec(),
        table: touch.table,
        objects: touch.objects.iter().map(|object| *object as u32).collect(),
    };
    proto::Contacts {
        robot_obstacle: contacts.robot_obstacle,
        robot_table: contacts.robot_table,
        objects: contacts.objects.iter().map(touch).collect(),
        ..proto::Contacts::default()
    }
}

fn phase(phase: Option<Phase>) -> proto::Phase {
    match phase {
        None => proto::Phase::Unspecified,
        Some(Phase::Approach) => proto::Phase::Approach,
        Some(Phase::Close) => proto::Phase::Close,
        Some(Phase::Carry) => proto::Phase::Carry,
        Some(Phase::Open) => proto::Phase::Open,
        Some(Phase::Retreat) => proto::Phase::Retreat,
    }
}
