//! A robot as data: an arm, the fingers of its hand, and what they weigh, bear and are shaped like.

use crate::joints::{Joints, MOST_JOINTS};
use nalgebra::{Isometry3, OMatrix, Translation3, U6, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// How far the length of a quaternion may be from 1: what rounding leaves is far less.
const UNIT: f64 = 1e-6;

/// A robot whose foot stands at the world's origin. Link 0 is the foot; link i + 1 hangs on joint i and moves with it. The arm's joints
/// come first, one behind the other, then those of the fingers; the last link of the arm is the hand.
///
/// ```
/// use hilt::robot::file::built_in::named;
///
/// let panda = named("panda").expect("it comes with hilt")?;
/// assert_eq!((panda.arm, panda.fingers().len()), (7, 2));
/// let tool = panda.tool_pose(&panda.ready);
/// assert!(tool.translation.z > 0.2, "the hand waits above the table");
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Robot {
    /// Short name.
    pub name: String,
    /// The foot, then one link a joint.
    pub links: Vec<Link>,
    /// The driven joints.
    pub joints: Vec<Joint>,
    /// How many of them are the arm's.
    pub arm: usize,
    /// Tool point between the finger pads in the hand's frame \[m\].
    pub tool_m: [f64; 3],
    /// The hand's orientation in the tool's frame, which is the world's when the hand points straight down at yaw 0.
    pub tool_from_hand: UnitQuaternion<f64>,
    /// Where every episode begins, one a joint \[rad, m\].
    pub ready: Joints,
    /// Position of each finger that closed around nothing \[rad, m\]; the open hand is that of the ready pose.
    pub closed: Vec<f64>,
    /// Speed of the fingers while they close, hold and open \[rad/s, m/s\].
    pub finger_speed: f64,
    /// Pairs of fingers that close on each other, counted from the first finger: two that press a block from both sides hold it.
    pub opposing: Vec<[usize; 2]>,
    /// Distances from the foot at which the level hand gets down to the table, near and far \[m\], where they are known.
    pub reach_m: Option<[f64; 2]>,
    /// What settles the joints where the pose of the tool does not.
    pub posture: Vec<Posture>,
}

/// A link with everything that is fixed to it, in the frame of its joint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Link {
    /// As in the URDF; also the `child_frame_id` of recorded transforms.
    pub name: String,
    /// Mass and its distribution.
    pub inertia: Inertia,
    /// Collision primitives.
    pub shapes: Vec<Shape>,
}

/// Mass, centre of mass and principal inertia of a link.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Inertia {
    /// \[kg\].
    pub mass_kg: f64,
    /// Centre of mass in the link's frame \[m\].
    pub com_m: [f64; 3],
    /// Moments about the principal axes through it \[kg m^2\].
    pub principal_kg_m2: [f64; 3],
    /// The principal axes in the link's frame.
    pub axes: UnitQuaternion<f64>,
}

/// How a joint moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum JointKind {
    /// Turns about the z axis of its frame \[rad\].
    Revolute,
    /// Slides along it \[m\].
    Prismatic,
}

/// A driven joint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Joint {
    /// As in the URDF; also in recorded joint states.
    pub name: String,
    /// Revolute or prismatic.
    pub kind: JointKind,
    /// Index of the link that it hangs on.
    pub parent: usize,
    /// `parent_from_joint` at position 0.
    pub origin: Isometry3<f64>,
    /// Lowest and highest position \[rad, m\]; of a joint that turns freely, what planning keeps within.
    pub limits: [f64; 2],
    /// Whether nothing stops it.
    pub continuous: bool,
    /// Highest speed \[rad/s, m/s\].
    pub velocity: f64,
    /// Highest torque or force \[N m, N\].
    pub effort: f64,
    /// What the motor and its gears add.
    pub motor: Motor,
}

/// What a motor and its gears add to a joint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Motor {
    /// Reflected inertia \[kg m^2, kg\].
    pub armature: f64,
    /// Viscous damping \[N m s/rad, N s/m\].
    pub damping: f64,
    /// Dry friction \[N m, N\].
    pub friction: f64,
}

/// A joint that is pulled to a position where the tool's pose leaves it free.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Posture {
    /// Which joint of the arm.
    pub joint: usize,
    /// Its position \[rad\].
    pub position: f64,
}

/// A collision primitive in its link's frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Shape {
    /// Segment with a radius.
    Capsule {
        /// One end \[m\].
        from_m: [f64; 3],
        /// Other end \[m\].
        to_m: [f64; 3],
        /// \[m\].
        radius_m: f64,
    },
    /// A box.
    Box {
        /// Its centre and axes.
        pose: Isometry3<f64>,
        /// Half of its edges \[m\].
        half_m: [f64; 3],
    },
}

/// Rows are linear \[m/rad\] then angular \[rad/rad\] velocity in the world frame, columns the joints of the arm.
pub type Jacobian = OMatrix<f64, U6, nalgebra::Dyn>;

impl Shape {
    /// A box along the link's axes.
    pub fn cuboid(center_m: [f64; 3], half_m: [f64; 3]) -> Self {
        Shape::Box { pose: Isometry3::from_parts(Translation3::from(center_m), UnitQuaternion::identity()), half_m }
    }
}

impl Joint {
    /// What a position does to the link.
    fn motion(&self, position: f64) -> Isometry3<f64> {
        match self.kind {
            JointKind::Revolute => {
                Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_axis_angle(&Vector3::z_axis(), position))
            }
            JointKind::Prismatic => Translation3::new(0.0, 0.0, position).into(),
        }
    }
}

impl Joint {
    /// What counts for it as a radian does for one that turns \[1, m/rad\]: what it slides in a second at its highest speed. Noise, slack and
    /// thresholds that are said in radians are meant so.
    pub fn per_radian(&self) -> f64 {
        match self.kind {
            JointKind::Revolute => 1.0,
            JointKind::Prismatic => self.velocity,
        }
    }

    fn unit(&self) -> &'static str {
        match self.kind {
            JointKind::Revolute => "rad",
            JointKind::Prismatic => "m",
        }
    }

    /// Name of the column that holds its position, with the unit.
    pub fn position_name(&self) -> String {
        format!("{}.q_{}", self.name, self.unit())
    }

    /// Name of the column that holds its velocity.
    pub fn velocity_name(&self) -> String {
        format!("{}.dq_{}_s", self.name, self.unit())
    }

    /// Name of the column that holds its command.
    pub fn command_name(&self) -> String {
        format!("{}.velocity_{}_s", self.name, self.unit())
    }

    /// The nearest velocity that does not ask for more than the joint has left on its way from `position` in `period_s`.
    pub fn within_limits(&self, velocity: f64, position: f64, period_s: f64) -> f64 {
        let [low, high] = self.limits;
        let (slowest, fastest) = ((low - position) / period_s, (high - position) / period_s);
        velocity.clamp(-self.velocity, self.velocity).clamp(slowest.min(0.0), fastest.max(0.0))
    }
}

impl Robot {
    /// Whether it can be one: what was written by hilt is, what was changed since may not be.
    ///
    /// # Errors
    /// Says what cannot be.
    pub fn check(&self) -> Result<(), String> {
        let (joints, fingers) = (self.joints.len(), self.joints.len().saturating_sub(self.arm));
        if !(1..=MOST_JOINTS).contains(&joints) || self.arm == 0 || self.arm > joints || self.links.len() != joints + 1 {
            return Err(format!("{joints} joints, {} of them the arm's, and {} links", self.arm, self.links.len()));
        }
        if self.ready.len() != joints || self.closed.len() != fingers {
            return Err(format!("a ready pose of {} joints and {} closed fingers", self.ready.len(), self.closed.len()));
        }
        if let Some(i) = (0..joints).find(|i| self.joints[*i].parent > *i) {
            return Err(format!("joint {} hangs on link {}, which comes after it", self.joints[i].name, self.joints[i].parent));
        }
        if self.opposing.iter().flatten().any(|finger| *finger >= fingers) || self.posture.iter().any(|p| p.joint >= self.arm) {
            return Err("a finger or a joint is named that it does not have".into());
        }
        let units = |turn: &UnitQuaternion<f64>| (turn.coords.norm() - 1.0).abs() < UNIT;
        let poses = self.links.iter().flat_map(|link| &link.shapes).filter_map(|shape| match shape {
            Shape::Box { pose, .. } => Some(&pose.rotation),
            Shape::Capsule { .. } => None,
        });
        let turns = self.joints.iter().map(|joint| &joint.origin.rotation).chain([&self.tool_from_hand]).chain(poses);
        if !turns.chain(self.links.iter().map(|link| &link.inertia.axes)).all(units) {
            return Err("a rotation is none: its quaternion has another length than 1".into());
        }
        Ok(())
    }

    /// Index of the hand's link.
    pub fn hand(&self) -> usize {
        self.arm
    }

    /// The joints of the fingers.
    pub fn fingers(&self) -> std::ops::Range<usize> {
        self.arm..self.joints.len()
    }

    /// Way of finger `i` (counted from the first finger) from the open hand until it has closed around nothing \[rad, m\].
    pub fn closing_way(&self, i: usize) -> f64 {
        self.closed[i] - self.ready[self.arm + i]
    }

    /// Whether two fingers press from both sides, of those for which `presses` holds.
    pub fn grips(&self, presses: impl Fn(usize) -> bool) -> bool {
        self.opposing.iter().any(|[one, other]| presses(*one) && presses(*other))
    }

    /// `world_from_link` of all links at joint positions `q` \[rad, m\].
    pub fn link_poses(&self, q: &[f64]) -> Vec<Isometry3<f64>> {
        let mut poses = Vec::with_capacity(self.links.len());
        poses.push(Isometry3::identity());
        for (joint, position) in self.joints.iter().zip(q) {
            let pose = poses[joint.parent] * joint.origin * joint.motion(*position);
            poses.push(pose);
        }
        poses
    }

    /// `world_from_tool` from the poses of the links.
    pub fn tool_of(&self, poses: &[Isometry3<f64>]) -> Isometry3<f64> {
        let hand = &poses[self.hand()];
        let point = hand * nalgebra::Point3::from(self.tool_m);
        Isometry3::from_parts(Translation3::from(point.coords), hand.rotation * self.tool_from_hand.inverse())
    }

    /// `world_from_tool`: at the tool point; "hand down at yaw psi" is Rz(psi).
    pub fn tool_pose(&self, q: &[f64]) -> Isometry3<f64> {
        self.tool_of(&self.link_poses(q))
    }

    /// The tool's pose and its Jacobian.
    pub fn tool_jacobian(&self, q: &[f64]) -> (Isometry3<f64>, Jacobian) {
        let poses = self.link_poses(q);
        let tool = self.tool_of(&poses);
        let mut jacobian = Jacobian::zeros(self.arm);
        for i in 0..self.arm {
            let axis = poses[i + 1].rotation * Vector3::z();
            let arm = tool.translation.vector - poses[i + 1].translation.vector;
            jacobian.fixed_view_mut::<3, 1>(0, i).copy_from(&axis.cross(&arm));
            jacobian.fixed_view_mut::<3, 1>(3, i).copy_from(&axis);
        }
        (tool, jacobian)
    }
}

#[cfg(test)]
mod tests {
    use crate::robot::file::built_in::paper_robot;
    use nalgebra::Vector3;

    #[test]
    fn ready_pose_holds_the_hand_down_above_the_spawn_area() {
        let tool = paper_robot().tool_pose(&paper_robot().ready);
        let expected = Vector3::new(0.45, 0.0, 0.30);
        assert!((tool.translation.vector - expected).norm() < 1e-3, "tool at {}", tool.translation.vector);
        assert!(tool.rotation.angle() < 1e-2, "hand turned by {} rad", tool.rotation.angle());
    }

    #[test]
    fn a_command_never_leads_beyond_a_limit() {
        let finger = &paper_robot().joints[6];
        assert_eq!(finger.within_limits(3.0, 0.5, 0.05), 1.0);
        assert!((finger.within_limits(1.0, 1.50, 0.05) - 0.2).abs() < 1e-9);
        assert_eq!(finger.within_limits(-1.0, -0.01, 0.05), 0.0);
    }
}
