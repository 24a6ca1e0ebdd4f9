//! What a viewer shows: transforms, joint states and the things of the scene.

use crate::demo::Step;
use crate::robot::Robot;
use crate::scene::Scene;
use crate::state::{Pose, State};
use crate::task::Shape;
use foxglove::messages::{
    self as msg, Color, CubePrimitive, CylinderPrimitive, FrameTransform, FrameTransforms, JointState, JointStates, Quaternion,
    SceneEntity, SceneUpdate, SpherePrimitive, Timestamp, Vector3,
};
use nalgebra::Isometry3;

/// The fixed frame: the robot's foot, z up.
pub const WORLD_FRAME: &str = "world";
/// The frame of an object of the task: no link of a robot is called so.
pub fn frame_of(object: &str) -> String {
    format!("object/{object}")
}

/// Drawn table: edge lengths \[m\]; it reaches past everything the arm can touch.
const TABLE_SIZE_M: [f64; 3] = [2.0, 2.0, 0.04];
/// Drawn goal: diameter of the ball \[m\].
const GOAL_DIAMETER_M: f64 = 0.02;
const GREY: [f64; 4] = [0.75, 0.75, 0.72, 1.0];
/// Objects that goals move: red, yellow, violet.
const MOVED: [[f64; 4]; 3] = [[0.80, 0.22, 0.18, 1.0], [0.88, 0.66, 0.16, 1.0], [0.55, 0.33, 0.68, 1.0]];
const BLUE: [f64; 4] = [0.20, 0.40, 0.75, 1.0];
const GREEN: [f64; 4] = [0.20, 0.65, 0.30, 0.8];
const DARK: [f64; 4] = [0.30, 0.30, 0.34, 1.0];
const NANOSECONDS_PER_SECOND: u64 = 1_000_000_000;

/// `/tf`: every link below its URDF parent (the base link below the world), and the objects.
pub(super) fn frames(scene: &Scene, step: &Step, time_ns: u64) -> FrameTransforms {
    let robot = &*scene.robot;
    let links = robot.link_poses(&step.state.q);
    let name = |link: usize| robot.links[link].name.as_str();
    let mut transforms = vec![transform(WORLD_FRAME, name(0), &links[0], time_ns)];
    for (i, joint) in robot.joints.iter().enumerate() {
        let parent_from_child = links[joint.parent].inverse() * links[i + 1];
        transforms.push(transform(name(joint.parent), name(i + 1), &parent_from_child, time_ns));
    }
    for (object, now) in scene.task.objects.iter().zip(&step.objects) {
        transforms.push(transform(WORLD_FRAME, &frame_of(&object.name), &now.pose.isometry(), time_ns));
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
    let table = cube([0.0, 0.0, -TABLE_SIZE_M[2] / 2.0], TABLE_SIZE_M, GREY);
    let mut entities = vec![SceneEntity { cubes: vec![table], ..entity("table", WORLD_FRAME) }];
    for (i, object) in scene.task.objects.iter().enumerate() {
        let rgba = if i < scene.task.moved() { MOVED[i % MOVED.len()] } else { BLUE };
        let mut drawn = entity(&object.name, &frame_of(&object.name));
        if let Shape::Cylinder { radius_m, height_m } = object.shape {
            drawn.cylinders.push(CylinderPrimitive {
                pose: Some(pose(&at([0.0; 3]))),
                size: Some(vector([2.0 * radius_m, 2.0 * radius_m, height_m])),
                bottom_scale: 1.0,
                top_scale: 1.0,
                color: Some(color(rgba)),
            });
        } else {
            let boxes = object.shape.boxes_m().into_iter();
            drawn.cubes = boxes.map(|(center, half)| cube(center, half.map(|h| 2.0 * h), rgba)).collect();
        }
        entities.push(drawn);
    }
    for (name, goal) in scene.task.goal_names().iter().zip(&scene.goals) {
        let ball =
            SpherePrimitive { pose: Some(pose(&at(*goal))), size: Some(vector([GOAL_DIAMETER_M; 3])), color: Some(color(GREEN)) };
        entities.push(SceneEntity { spheres: vec![ball], ..entity(name, WORLD_FRAME) });
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
