//! Contact physics: the robot, the table, the objects of a task and the obstacles in one rapier world, stepped at the control rate.
//! The only module that knows rapier.

mod arm;
mod contacts;
mod convert;
mod disturbance;
mod env;
mod episode;
mod execute;
mod follower;
#[cfg(test)]
mod free_motion_tests;
mod physics;
mod reexecute;
mod world;

pub use disturbance::Disturbance;
pub use env::TaskEnv;
pub use episode::{Controller, fallen, run_episode, run_episode_from};
pub use execute::execute;
pub use follower::Follower;
pub use physics::{Grain, Physics};
pub use reexecute::reexecute;
pub use world::World;
