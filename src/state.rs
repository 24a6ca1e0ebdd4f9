//! State and action of the paper: s_t and a_t, with the names and units of their columns.

use crate::joints::Joints;
use crate::math;
use crate::task::Task;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Control rate \[Hz\].
pub const CONTROL_HZ: u32 = 20;
/// Duration of a control step \[s\].
pub const CONTROL_DT_S: f64 = 1.0 / CONTROL_HZ as f64;

/// Entries of a pose: x y z, qx qy qz qw.
const POSE_DIM: usize = 7;
/// Entries of a point: x y z.
const POINT_DIM: usize = 3;

/// a_t: a velocity command for each joint \[rad/s, m/s\].
pub type Action = Joints;

/// Position \[m\] and orientation (unit quaternion x y z w) of a body in the world frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// x y z \[m\].
    pub position_m: [f64; 3],
    /// Unit quaternion, x y z w.
    pub quaternion_xyzw: [f64; 4],
}

impl Pose {
    /// A pose turned by `yaw_rad` about the world's z axis.
    pub fn from_yaw(position_m: [f64; 3], yaw_rad: f64) -> Self {
        let (sin, cos) = math::sin_cos(yaw_rad / 2.0);
        Pose { position_m, quaternion_xyzw: [0.0, 0.0, sin, cos] }
    }

    /// Turn about the world's z axis \[rad\].
    pub fn yaw_rad(&self) -> f64 {
        self.isometry().rotation.euler_angles().2
    }

    /// Cosine of the angle by which it leans, against how it stood: 1 upright, 0 on its side.
    pub fn uprightness(&self, stood: &Pose) -> f64 {
        let up = stood.isometry().rotation.inverse() * Vector3::z();
        (self.isometry() * up).z
    }

    /// The same as an nalgebra isometry.
    pub fn isometry(&self) -> Isometry3<f64> {
        let [x, y, z, w] = self.quaternion_xyzw;
        Isometry3::from_parts(Translation3::from(self.position_m), UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)))
    }

    /// From an nalgebra isometry.
    pub fn from_isometry(iso: &Isometry3<f64>) -> Self {
        let q = iso.rotation.coords;
        Pose { position_m: iso.translation.vector.into(), quaternion_xyzw: [q.x, q.y, q.z, q.w] }
    }

    /// As x y z qx qy qz qw.
    pub fn to_array(self) -> [f64; 7] {
        let ([x, y, z], [qx, qy, qz, qw]) = (self.position_m, self.quaternion_xyzw);
        [x, y, z, qx, qy, qz, qw]
    }

    /// From x y z qx qy qz qw.
    pub fn from_array(v: [f64; 7]) -> Self {
        Pose { position_m: [v[0], v[1], v[2]], quaternion_xyzw: [v[3], v[4], v[5], v[6]] }
    }
}

/// s_t: what the policy sees at a control step. Vector form: joint positions, joint velocities, a pose of each object (7), goals (3 each).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Joint positions \[rad, m\].
    pub q: Joints,
    /// Joint velocities \[rad/s, m/s\].
    pub dq: Joints,
    /// Poses of the task's objects, in its order: of those that goals move as they are now, each quaternion sign-continuous along an episode;
    /// of the others as they stood at the start.
    pub objects: Vec<Pose>,
    /// Goals that are places on the table: where the object's centre is to be \[m\].
    pub goals: Vec<[f64; POINT_DIM]>,
}

impl State {
    /// The state as a row (f32: the simulator's own precision).
    pub fn to_row(&self) -> Vec<f32> {
        let joints = self.q.iter().chain(&self.dq).copied();
        let poses = self.objects.iter().flat_map(|pose| pose.to_array());
        joints.chain(poses).chain(self.goals.iter().flatten().copied()).map(|v| v as f32).collect()
    }

    /// The inverse of [`State::to_row`], of a robot with so many joints; `None` when the row is not as long as the task's states.
    pub fn from_row(task: &Task, joints: usize, row: &[f32]) -> Option<Self> {
        let row: Vec<f64> = row.iter().map(|v| f64::from(*v)).collect();
        let (q, row) = row.split_at_checked(joints)?;
        let (dq, row) = row.split_at_checked(joints)?;
        let (poses, points) = row.split_at_checked(POSE_DIM * task.objects.len())?;
        let (goals, rest) = points.as_chunks::<POINT_DIM>();
        if !rest.is_empty() || goals.len() != task.goal_names().len() {
            return None;
        }
        let objects = poses.as_chunks::<POSE_DIM>().0.iter().map(|pose| Pose::from_array(*pose)).collect();
        Some(State { q: Joints::of(q)?, dq: Joints::of(dq)?, objects, goals: goals.to_vec() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::built_in::{pick_and_place, pick_up, stack};

    #[test]
    fn a_row_round_trips_for_any_number_of_joints() {
        for (task, joints, dim) in [(pick_up(), 9, 25), (pick_and_place(), 9, 28), (stack(), 7, 28), (stack(), 9, 32)] {
            let row: Vec<f32> = (0..dim).map(|i| i as f32 * 0.25).collect();
            let state = State::from_row(&task, joints, &row).expect("row has the task's length");
            assert_eq!(state.to_row(), row);
            assert!(State::from_row(&task, joints, &row[1..]).is_none());
        }
    }
}
