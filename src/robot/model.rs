//! A robot as data: an arm, the fingers of its hand, and what they weigh, bear and are shaped like.

use nalgebra::{Isometry3, OMatrix, Translation3, U6, UnitQuaternion, Vector3};

/// A robot whose foot stands at the world's origin. Link 0 is the foot; link i + 1 hangs on joint i and moves with it. The arm's joints
/// come first, one behind the other, then those of the fingers; the last link of the arm is the hand.
#[derive(Clone, Debug, PartialEq)]
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
    pub ready: Vec<f64>,
    /// Position of each finger that closed around nothing \[rad, m\]; the open hand is that of the ready pose.
    pub closed: Vec<f64>,
    /// Speed of the fingers while they close, hold and open \[rad/s, m/s\].
    pub finger_speed: f64,
    /// What settles the joints where the pose of the tool does not.
    pub posture: Vec<Posture>,
}

/// A link with everything that is fixed to it, in the frame of its joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// As in the URDF; also the `child_frame_id` of recorded transforms.
    pub name: String,
    /// Mass and its distribution.
    pub inertia: Inertia,
    /// Collision primitives.
    pub shapes: Vec<Shape>,
}

/// Mass, centre of mass and principal inertia of a link.
#[derive(Clone, Copy, Debug, PartialEq)]
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
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// Turns about the z axis of its frame \[rad\].
    Revolute,
    /// Slides along it \[m\].
    Prismatic,
}

/// A driven joint.
#[derive(Clone, Debug, PartialEq)]
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
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motor {
    /// Reflected inertia \[kg m^2, kg\].
    pub armature: f64,
    /// Viscous damping \[N m s/rad, N s/m\].
    pub damping: f64,
    /// Dry friction \[N m, N\].
    pub friction: f64,
}

/// A joint that is pulled to a position where the tool's pose leaves it free.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Posture {
    /// Which joint of the arm.
    pub joint: usize,
    /// Its position \[rad\].
    pub position: f64,
}

/// A collision primitive in its link's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
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

impl Robot {
    /// Index of the hand's link.
    pub fn hand(&self) -> usize {
        self.arm
    }

    /// The joints of the fingers.
    pub fn fingers(&self) -> std::ops::Range<usize> {
        self.arm..self.joints.len()
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
