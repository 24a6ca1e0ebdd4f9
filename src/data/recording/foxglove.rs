//! What a viewer shows: transforms, joint states and the things of the scene.

use crate::demo::Step;
use crate::robot::Robot;
use crate::scene::{BLOCK_EDGE_M, Scene};
use crate::state::{Context, Pose, State};
use foxglove::messages::{
    self as msg, Color, CubePrimitive, FrameTransform, FrameTransforms, JointState, JointStates, Quaternion, SceneEntity,
    SceneUpdate, SpherePrimitive, Timestamp, Vector3,
};
use nalgebra::Isometry3;

/// The fixed frame: the robot's foot, z up.
pub const WORLD_FRAME: &str = "world";
/// The block to move.
pub const BLOCK_FRAME: &str = "block";
/// The base block of the stack task.
pub const BASE_FRAME: &str = "base_block";

/// Drawn table: edge lengths \[m\]; it reaches past everything the arm can touch.
const TABLE_SIZE_M: [f64; 3] = [2.0, 2.0, 0.04];
/// Drawn goal: diameter of the ball \[m\].
const GOAL_DIAMETER_M: f64 = 0.02;
const GREY: [f64; 4] = [0.75, 0.75, 0.72, 1.0];
const RED: [f64; 4] = [0.80, 0.22, 0.18, 1.0];
const BLUE: [f64; 4] = [0.20, 0.40, 0.75, 1.0];
const GREEN: [f64; 4] = [0.20, 0.65, 0.30, 0.8];
const DARK: [f64; 4] = [0.30, 0.30, 0.34, 1.0];
const NANOSECONDS_PER_SECOND: u64 = 1_000_000_000;

/// `/tf`: every link below its URDF parent (the base link below the world), the block, the base block.
pub(super) fn frames(robot: &Robot, step: &Step, time_ns: u64) -> FrameTransforms {
    let links = robot.link_poses(&step.state.q);
    let name = |link: usize| robot.links[link].name.as_str();
    let mut transforms = vec![transform(WORLD_FRAME, name(0), &links[0], time_ns)];
    for (i, joint) in robot.joints.iter().enumerate() {
        let parent_from_child = links[joint.parent].inverse() * links[i + 1];
        transforms.push(transform(name(joint.parent), name(i + 1), &parent_from_child, time_ns));
    }
    transforms.push(transform(WORLD_FRAME, BLOCK_FRAME, &step.state.block.isometry(), time_ns));
    if let Some(base) = step.base_now {
        transforms.push(transform(WORLD_FRAME, BASE_FRAME, &base.isometry(), time_ns));
    }
    FrameTransforms { transforms }
}

/// `/joint_states`.
pub(super) fn joints(robot: &Robot, state: &State, time_ns: u64) -> JointStates {
    let joint = |i: usize| JointState {
        name: robot.joints[i].name.clone(),
        position: Some(state.q[i]),
        velocity: Some(state.dq[i]),
        acceleration: None,
        effort: None,
    };
    JointStates { timestamp: Some(timestamp(time_ns)), joints: (0..robot.joints.len()).map(joint).collect() }
}

/// `/scene`: things that keep their shape; those that move are locked to their frame.
pub(super) fn drawing(scene: &Scene) -> SceneUpdate {
    let block = [BLOCK_EDGE_M; 3];
    let table = cube([0.0, 0.0, -TABLE_SIZE_M[2] / 2.0], TABLE_SIZE_M, GREY);
    let mut entities = vec![
        SceneEntity { cubes: vec![table], ..entity("table", WORLD_FRAME) },
        SceneEntity { cubes: vec![cube([0.0; 3], block, RED)], ..entity("block", BLOCK_FRAME) },
    ];
    match scene.context {
        Context::None => {}
        Context::Goal(goal) => {
            let ball = SpherePrimitive {
                pose: Some(pose(&at(goal))),
                size: Some(vector([GOAL_DIAMETER_M; 3])),
                color: Some(color(GREEN)),
            };
            entities.push(SceneEntity { spheres: vec![ball], ..entity("goal", WORLD_FRAME) });
        }
        Context::Base(_) => {
            entities.push(SceneEntity { cubes: vec![cube([0.0; 3], block, BLUE)], ..entity("base_block", BASE_FRAME) });
        }
    }
    if !scene.obstacles.is_empty() {
        let cubes = scene.obstacles.iter().map(|o| cube(o.center_m, o.size_m, DARK)).collect();
        entities.push(SceneEntity { cubes, ..entity("obstacles", WORLD_FRAME) });
    }
    SceneUpdate { deletions: Vec::new(), entities }
}

/// An empty entity that stays until the end.
fn entity(id: &str, frame: &str) -> SceneEntity {
    SceneEntity {
        timestamp: Some(timestamp(0)),
        frame_id: frame.into(),
        id: id.into(),
        frame_locked: true,
        ..SceneEntity::default()
    }
}

fn cube(center_m: [f64; 3], size_m: [f64; 3], rgba: [f64; 4]) -> CubePrimitive {
    CubePrimitive { pose: Some(pose(&at(center_m))), size: Some(vector(size_m)), color: Some(color(rgba)) }
}

fn at(position_m: [f64; 3]) -> Pose {
    Pose::from_yaw(position_m, 0.0)
}

fn transform(parent: &str, child: &str, parent_from_child: &Isometry3<f64>, time_ns: u64) -> FrameTransform {
    let pose = Pose::from_isometry(parent_from_child);
    FrameTransform {
        timestamp: Some(timestamp(time_ns)),
        parent_frame_id: parent.into(),
        child_frame_id: child.into(),
        translation: Some(vector(pose.position_m)),
        rotation: Some(quaternion(pose.quaternion_xyzw)),
    }
}

fn pose(pose: &Pose) -> msg::Pose {
    msg::Pose { position: Some(vector(pose.position_m)), orientation: Some(quaternion(pose.quaternion_xyzw)) }
}

fn vector([x, y, z]: [f64; 3]) -> Vector3 {
    Vector3 { x, y, z }
}

fn quaternion([x, y, z, w]: [f64; 4]) -> Quaternion {
    Quaternion { x, y, z, w }
}

fn color([r, g, b, a]: [f64; 4]) -> Color {
    Color { r, g, b, a }
}

fn timestamp(time_ns: u64) -> Timestamp {
    let (seconds, rest) = (time_ns / NANOSECONDS_PER_SECOND, time_ns % NANOSECONDS_PER_SECOND);
    Timestamp::new(seconds as u32, rest as u32)
}
