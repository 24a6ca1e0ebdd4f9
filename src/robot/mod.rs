//! The arm: constants of the Kinova Jaco j2n6s300, forward kinematics, Jacobian, differential inverse kinematics, URDF. And robots as data, from two
//! files each: [`Robot`] is what they say, [`file::read`] reads them.

pub mod check;
pub mod collision;
pub mod file;
pub mod ik;
pub mod jaco;
pub mod kinematics;
pub mod model;
pub mod urdf;

pub use ik::{Ik, Unreachable};
pub use jaco::{LINK_SHAPES, LinkShape, POSITION_LIMITS_RAD, READY_Q_RAD, Shape, VELOCITY_LIMITS_RAD_S};
pub use kinematics::{Arm, LinkPoses};
pub use model::Robot;
pub use urdf::urdf;
