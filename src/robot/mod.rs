//! Robots as data, from two files each: [`Robot`] is what they say, [`file::read`] reads them. Kinematics, distances, differential inverse
//! kinematics, and what there is to know about a robot before it is used.

pub mod check;
pub mod collision;
pub mod file;
mod hand;
pub mod ik;
pub mod model;
mod motors;
pub mod write_urdf;

pub use ik::{Ik, Unreachable};
pub use model::Robot;
pub use write_urdf::{TOOL_FRAME, urdf};
