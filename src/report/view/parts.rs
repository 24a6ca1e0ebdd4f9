//! Robots and meshes, each once on a page however many episodes have it.

use super::pack::{f32s, shares_i8, shares_i16, u16s};
use crate::report::render::mesh::{Detail, Mesh, Vertex};
use crate::report::render::{TABLE_M, TABLE_THICKNESS_M, links};
use crate::robot::Robot;
use crate::robot::model::{Joint, JointKind};
use crate::state::Pose;
use nalgebra::Isometry3;
use serde_json::{Value, json};

/// The table's lower layer begins so far below its top, which the page draws with grid and shadows \[m\].
const BELOW_TOP_M: f64 = 0.0005;

/// What the episodes of a page share.
#[derive(Debug, Default)]
pub(super) struct Parts {
    pub(super) meshes: Vec<Value>,
    pub(super) robots: Vec<Value>,
}

/// The number of a value in a list that has each once.
fn numbered(list: &mut Vec<Value>, value: Value) -> usize {
    list.iter().position(|other| *other == value).unwrap_or_else(|| {
        list.push(value);
        list.len() - 1
    })
}

impl Parts {
    /// The number of a mesh.
    pub(super) fn mesh(&mut self, mesh: &Mesh) -> usize {
        let size = mesh.vertices.iter().flat_map(|v| v.at.iter()).fold(f32::MIN_POSITIVE, |most, v| most.max(v.abs()));
        let of = |pick: fn(&Vertex) -> nalgebra::Vector3<f32>| mesh.vertices.iter().flat_map(move |v| <[f32; 3]>::from(pick(v)));
        let corner = |i: u32| u16::try_from(i).expect("a shape or a marker has a few hundred corners");
        let value = json!({
            "size": size,
            "at": shares_i16(of(|v| v.at).map(|v| v / size)),
            "normal": shares_i8(of(|v| v.normal)),
            "index": u16s(mesh.triangles.iter().flatten().map(|i| corner(*i))),
        });
        numbered(&mut self.meshes, value)
    }

    /// The number of a robot.
    pub(super) fn robot(&mut self, robot: &Robot) -> usize {
        let parts: Vec<Value> = links::of_robot(robot, Detail::LIGHT)
            .iter()
            .map(|(link, mesh, pose, rgb)| json!({ "link": link, "mesh": self.mesh(mesh), "pose": pose_of(pose), "rgb": rgb }))
            .collect();
        let joint = |joint: &Joint| {
            let slides = joint.kind == JointKind::Prismatic;
            json!({ "name": joint.name, "parent": joint.parent, "slides": slides, "origin": pose_of(&joint.origin) })
        };
        let joints: Vec<Value> = robot.joints.iter().map(joint).collect();
        numbered(&mut self.robots, json!({ "name": robot.name, "joints": joints, "parts": parts }))
    }
}

/// Position and quaternion x y z w.
fn pose_of(pose: &Isometry3<f64>) -> [f64; 7] {
    Pose::from_isometry(pose).to_array()
}

/// The table below its top.
pub(super) fn table() -> Mesh {
    let [x, y] = TABLE_M;
    let middle = |[low, high]: [f64; 2]| (low + high) / 2.0;
    let half = |[low, high]: [f64; 2]| (high - low) / 2.0;
    let half_height = (TABLE_THICKNESS_M - BELOW_TOP_M) / 2.0;
    Mesh::cuboid([middle(x), middle(y), -BELOW_TOP_M - half_height], [half(x), half(y), half_height])
}

/// Rows of numbers, one after the other.
pub(super) fn rows<R: IntoIterator<Item = f64>>(rows: impl IntoIterator<Item = R>) -> String {
    f32s(rows.into_iter().flatten())
}
