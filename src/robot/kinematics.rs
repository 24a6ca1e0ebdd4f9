//! Forward kinematics and the geometric Jacobian of the tool point.

use super::jaco::{HAND_LINK, JOINT_SPECS, LINKS, TOOL_IN_HAND_M};
use crate::state::{ARM_JOINTS, JOINTS};
use nalgebra::{Isometry3, Matrix6, Point3, Translation3, UnitQuaternion, Vector3};

/// `world_from_link` of the ten links (base, 1..6, fingers 1..3).
pub type LinkPoses = [Isometry3<f64>; LINKS];

/// The kinematic chain, with the fixed transforms computed once.
#[derive(Clone, Debug)]
pub struct Arm {
    /// `parent_from_joint` at zero angle.
    origins: [Isometry3<f64>; JOINTS],
}

impl Default for Arm {
    fn default() -> Self {
        Arm::new()
    }
}

impl Arm {
    /// The Jaco, its base at the world's origin.
    pub fn new() -> Self {
        let origins = JOINT_SPECS.map(|j| {
            let [roll, pitch, yaw] = j.rpy_rad;
            Isometry3::from_parts(Translation3::from(j.xyz_m), UnitQuaternion::from_euler_angles(roll, pitch, yaw))
        });
        Arm { origins }
    }

    /// `parent_from_joint` of joint `i` at zero angle.
    pub fn origin(&self, i: usize) -> &Isometry3<f64> {
        &self.origins[i]
    }

    /// Poses of all links at joint angles `q` \[rad\].
    pub fn link_poses(&self, q: &[f64; JOINTS]) -> LinkPoses {
        let mut poses = [Isometry3::identity(); LINKS];
        for (i, spec) in JOINT_SPECS.iter().enumerate() {
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), q[i]);
            poses[i + 1] = poses[spec.parent] * self.origins[i] * turn;
        }
        poses
    }

    /// `world_from_tool`: at the tool point, with the hand's orientation. "Hand down at yaw psi" is Rz(psi).
    pub fn tool_pose(&self, q: &[f64; JOINTS]) -> Isometry3<f64> {
        tool_of(&self.link_poses(q))
    }

    /// World position of the tool point and its 6 x 6 Jacobian: rows are linear \[m/rad\] then angular \[rad/rad\] velocity in the
    /// world frame, columns the six arm joints.
    pub fn tool_jacobian(&self, q: &[f64; JOINTS]) -> (Isometry3<f64>, Matrix6<f64>) {
        let poses = self.link_poses(q);
        let tool = tool_of(&poses);
        let mut jacobian = Matrix6::zeros();
        for i in 0..ARM_JOINTS {
            let axis = poses[i + 1].rotation * Vector3::z();
            let arm = tool.translation.vector - poses[i + 1].translation.vector;
            jacobian.fixed_view_mut::<3, 1>(0, i).copy_from(&axis.cross(&arm));
            jacobian.fixed_view_mut::<3, 1>(3, i).copy_from(&axis);
        }
        (tool, jacobian)
    }
}

/// `world_from_tool` from the links' poses.
pub fn tool_of(poses: &LinkPoses) -> Isometry3<f64> {
    let hand = &poses[HAND_LINK];
    let point = hand * Point3::from(TOOL_IN_HAND_M);
    Isometry3::from_parts(Translation3::from(point.coords), hand.rotation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::jaco::READY_Q_RAD;

    #[test]
    fn ready_pose_holds_the_hand_down_above_the_spawn_area() {
        let tool = Arm::new().tool_pose(&READY_Q_RAD);
        let expected = Vector3::new(0.45, 0.0, 0.30);
        assert!((tool.translation.vector - expected).norm() < 1e-3, "tool at {}", tool.translation.vector);
        assert!(tool.rotation.angle() < 1e-2, "hand turned by {} rad", tool.rotation.angle());
    }

    #[test]
    fn jacobian_equals_finite_differences() {
        let (arm, h) = (Arm::new(), 1e-6);
        let q = READY_Q_RAD.map(|v| v + 0.1);
        let (_, jacobian) = arm.tool_jacobian(&q);
        for i in 0..ARM_JOINTS {
            let moved = |sign: f64| {
                let mut q = q;
                q[i] += sign * h;
                arm.tool_pose(&q)
            };
            let (plus, minus) = (moved(1.0), moved(-1.0));
            let linear = (plus.translation.vector - minus.translation.vector) / (2.0 * h);
            let angular = (plus.rotation * minus.rotation.inverse()).scaled_axis() / (2.0 * h);
            assert!((linear - jacobian.fixed_view::<3, 1>(0, i)).norm() < 1e-7);
            assert!((angular - jacobian.fixed_view::<3, 1>(3, i)).norm() < 1e-7);
        }
    }
}
