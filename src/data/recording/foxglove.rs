//! What a viewer shows: transforms, joint states and the things of the scene.

use super::surroundings::{Thing, WORLD_FRAME, frame_of, things};
use crate::demo::Step;
use crate::robot::Robot;
use crate::robot::write_urdf::{Geometry, Solid};
use crate::scene::Scene;
use crate::state::{Pose, State};
use foxglove::messages::{
    self as msg, Color, CubePrimitive, CylinderPrimitive, FrameTransform, FrameTransforms, JointState, JointStates, Quaternion,
    SceneEntity, SceneUpdate, SpherePrimitive, Timestamp, Vector3,
};
use nalgebra::Isometry3;

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
    SceneUpdate { deletions: Vec::new(), entities: things(scene).iter().map(drawn).collect() }
}

fn drawn(Thing { name, frame, solids }: &Thing) -> SceneEntity {
    let mut drawn = entity(name, frame);
    for Solid { at_m, geometry, rgba } in solids {
        let (pose, color) = (Some(pose(&Pose::from_yaw(*at_m, 0.0))), Some(color(*rgba)));
        match *geometry {
            Geometry::Box(size_m) => drawn.cubes.push(CubePrimitive { pose, size: Some(vector(size_m)), color }),
            Geometry::Cylinder { radius_m, height_m } => drawn.cylinders.push(CylinderPrimitive {
                pose,
                size: Some(vector([2.0 * radius_m, 2.0 * radius_m, height_m])),
                bottom_scale: 1.0,
                top_scale: 1.0,
                color,
            }),
            Geometry::Ball(radius_m) => {
                drawn.spheres.push(SpherePrimitive { pose, size: Some(vector([2.0 * radius_m; 3])), color });
            }
        }
    }
    drawn
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
