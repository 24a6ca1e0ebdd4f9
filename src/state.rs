//! State and action of the paper: s_t and a_t, with the names and units of their columns.

use crate::math;
use crate::task::Task;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use serde::{Deserialize, Serialize};

/// Joints of the arm proper (Kinova Jaco j2n6s300).
pub const ARM_JOINTS: usize = 6;
/// Fingers of the hand.
pub const FINGERS: usize = 3;
/// All driven joints: arm, then fingers.
pub const JOINTS: usize = ARM_JOINTS + FINGERS;
/// Entries of the state that every task has: q (9), dq (9), block pose (7).
pub const BASE_DIM: usize = 2 * JOINTS + POSE_DIM;
/// Most entries that a task appends: the pose of stack's base block.
pub const MOST_CONTEXT: usize = POSE_DIM;
/// Entries of a pose: x y z, qx qy qz qw.
const POSE_DIM: usize = 7;
/// Control rate \[Hz\].
pub const CONTROL_HZ: u32 = 20;
/// Duration of a control step \[s\].
pub const CONTROL_DT_S: f64 = 1.0 / CONTROL_HZ as f64;

/// Joint names, in the order of every 9-vector.
pub const JOINT_NAMES: [&str; JOINTS] =
    ["joint_1", "joint_2", "joint_3", "joint_4", "joint_5", "joint_6", "finger_1", "finger_2", "finger_3"];

/// a_t: joint velocity command \[rad/s\], 6 arm joints then 3 fingers.
pub type Action = [f64; JOINTS];

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

/// The constants of an episode that the state carries: inputs of policy and dynamics, never outputs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Context {
    /// Pick-up: nothing.
    None,
    /// Pick-and-place: the goal position of the block's centre \[m\].
    Goal([f64; 3]),
    /// Stack: the pose of the base block.
    Base(Pose),
}

/// s_t: what the policy sees at a control step. Vector form: q (9), dq (9), block pose (7), context (0, 3 or 7).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Joint angles \[rad\].
    pub q_rad: [f64; JOINTS],
    /// Joint velocities \[rad/s\].
    pub dq_rad_s: [f64; JOINTS],
    /// Pose of the block to move; its quaternion is sign-continuous along an episode.
    pub block: Pose,
    /// What the task adds.
    pub context: Context,
}

impl Task {
    /// D: 25, 28 or 32.
    pub fn state_dim(self) -> usize {
        BASE_DIM + [0, 3, POSE_DIM][self as usize]
    }
}

impl State {
    /// The state as a row of `task.state_dim()` numbers (f32: the simulator's own precision).
    pub fn to_row(&self) -> Vec<f32> {
        let mut row: Vec<f32> = Vec::with_capacity(BASE_DIM + 7);
        row.extend(self.q_rad.iter().chain(&self.dq_rad_s).map(|v| *v as f32));
        row.extend(self.block.to_array().map(|v| v as f32));
        match self.context {
            Context::None => {}
            Context::Goal(goal) => row.extend(goal.map(|v| v as f32)),
            Context::Base(base) => row.extend(base.to_array().map(|v| v as f32)),
        }
        row
    }

    /// The inverse of [`State::to_row`]; `None` when the row's length is not `task.state_dim()`.
    pub fn from_row(task: Task, row: &[f32]) -> Option<Self> {
        if row.len() != task.state_dim() {
            return None;
        }
        let at = |range: std::ops::Range<usize>| row[range].iter().map(|v| f64::from(*v));
        let pose = |from: usize| {
            let mut v = [0.0; 7];
            at(from..from + 7).zip(&mut v).for_each(|(x, slot)| *slot = x);
            Pose::from_array(v)
        };
        let (mut q_rad, mut dq_rad_s) = ([0.0; JOINTS], [0.0; JOINTS]);
        at(0..JOINTS).zip(&mut q_rad).for_each(|(x, slot)| *slot = x);
        at(JOINTS..2 * JOINTS).zip(&mut dq_rad_s).for_each(|(x, slot)| *slot = x);
        let extra = |i: usize| f64::from(row[BASE_DIM + i]);
        let context = match task {
            Task::PickUp => Context::None,
            Task::PickAndPlace => Context::Goal([extra(0), extra(1), extra(2)]),
            Task::Stack => Context::Base(pose(BASE_DIM)),
        };
        Some(State { q_rad, dq_rad_s, block: pose(2 * JOINTS), context })
    }

    /// Column names with units of the vector form, e.g. `joint_1.q_rad`, `block.x_m`, `goal.x_m`.
    pub fn column_names(task: Task) -> Vec<String> {
        let mut names: Vec<String> = JOINT_NAMES.iter().map(|j| format!("{j}.q_rad")).collect();
        names.extend(JOINT_NAMES.iter().map(|j| format!("{j}.dq_rad_s")));
        names.extend(pose_names("block"));
        match task {
            Task::PickUp => {}
            Task::PickAndPlace => names.extend(["goal.x_m", "goal.y_m", "goal.z_m"].map(String::from)),
            Task::Stack => names.extend(pose_names("base")),
        }
        names
    }
}

fn pose_names(body: &str) -> impl Iterator<Item = String> + '_ {
    ["x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"].into_iter().map(move |c| format!("{body}.{c}"))
}

/// Column names with units of an action.
pub fn action_names() -> Vec<String> {
    JOINT_NAMES.iter().map(|j| format!("{j}.velocity_rad_s")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn row_round_trips_and_names_match_the_dimension() {
        for task in Task::ALL {
            let row: Vec<f32> = (0..task.state_dim()).map(|i| i as f32 * 0.25).collect();
            let state = State::from_row(task, &row).expect("row has the task's length");
            assert_eq!(state.to_row(), row);
            assert_eq!(State::column_names(task).len(), task.state_dim());
            assert!(State::from_row(task, &row[1..]).is_none());
        }
    }
}
