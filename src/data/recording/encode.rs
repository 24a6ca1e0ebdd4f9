//! From an episode's own types to the messages of `proto/hilt.proto`.

use crate::data::proto;
use crate::demo::{Contacts, Episode, Phase, Step};
use crate::scene::{Obstacle, Scene};
use crate::state::{Context, Pose};
use crate::task::{FailureClass, Task};

pub(super) fn step(step: &Step, task: Task, number: usize, final_state: bool) -> proto::Step {
    let conditions = task.condition_names().iter().zip(&step.conditions);
    proto::Step {
        step: number as u64,
        q_rad: step.state.q.to_vec(),
        dq_rad_s: step.state.dq.to_vec(),
        block: Some(pose(&step.state.block)),
        context: Some(context(&step.state.context)),
        base_now: step.base_now.as_ref().map(pose),
        commanded_rad_s: step.commanded.to_vec(),
        executed_rad_s: step.executed.to_vec(),
        contacts: Some(contacts(&step.contacts)),
        block_speed_m_s: step.block_speed_m_s,
        reward: step.reward,
        conditions: conditions.map(|(name, holds)| proto::Condition { name: (*name).into(), holds: *holds }).collect(),
        phase: phase(step.phase).into(),
        final_state,
    }
}

pub(super) fn scene(scene: &Scene) -> proto::Scene {
    let obstacle = |o: &Obstacle| proto::Obstacle { center_m: o.center_m.to_vec(), size_m: o.size_m.to_vec() };
    proto::Scene {
        task: scene.task.name().into(),
        block: Some(pose(&scene.block)),
        context: Some(context(&scene.context)),
        obstacles: scene.obstacles.iter().map(obstacle).collect(),
        friction: scene.friction,
        block_mass_kg: scene.block_mass_kg,
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

fn context(context: &Context) -> proto::Context {
    let kind = match context {
        Context::None => None,
        Context::Goal(goal) => Some(proto::context::Kind::Goal(proto::Point { position_m: goal.to_vec() })),
        Context::Base(base) => Some(proto::context::Kind::Base(pose(base))),
    };
    proto::Context { kind }
}

fn contacts(contacts: &Contacts) -> proto::Contacts {
    proto::Contacts {
        finger_block_n: contacts.finger_block_n.to_vec(),
        block_table: contacts.block_table,
        block_base: contacts.block_base,
        robot_obstacle: contacts.robot_obstacle,
        robot_table: contacts.robot_table,
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
