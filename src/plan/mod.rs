//! From a scene to a demonstration: grasp, collision-free path, smooth joint trajectory sampled at the control rate.
//!
//! Demonstrations have low entropy on purpose: one grasp, one branch of the wrist, straight lines with rounded corners; a search only where
//! something stands in the way.

mod block;
mod episode;
mod grasp;
mod path;
mod planner;
mod search;
mod smooth;
mod table;
mod timing;
mod transit;
mod world;

pub use block::{Block, Planned, block_from_table, block_to_table};
pub use episode::plan_episode;
pub use grasp::RELEASE_GAP_M;
pub use planner::Planner;
pub use smooth::Limits;
pub use table::{Plans, from_table, to_table};
pub use world::{CLEARANCE_M, RESOLUTION_M, check_ready_pose};

use crate::demo::Phase;
use crate::joints::Joints;
use crate::scene::Scene;

/// One sample of a plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waypoint {
    /// Which goal of the task this is for.
    pub goal: usize,
    /// Which part of the plan this is.
    pub phase: Phase,
    /// Joint positions \[rad, m\].
    pub q: Joints,
    /// Velocity that leads to the next sample in one control step \[rad/s, m/s\]; zero on the last sample of each phase, where the arm rests.
    pub dq: Joints,
}

/// One planned demonstration, sampled at [`crate::state::CONTROL_HZ`]. For each goal of the task, in order, phases come
/// in the order of [`Phase::ALL`]; a lift ends with its carry.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Episode number.
    pub index: u64,
    /// What stands where.
    pub scene: Scene,
    /// The samples, [`crate::state::CONTROL_DT_S`] apart.
    pub waypoints: Vec<Waypoint>,
}

/// Why a scene has no plan.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// No joint angles put the open hand around an object, or the held object at its target.
    #[error("grasp: {0}")]
    Grasp(String),
    /// No collision-free way between two hand poses.
    #[error("transit: {0}")]
    Transit(String),
    /// No smooth trajectory within the limits and clear of obstacles.
    #[error("smoothing: {0}")]
    Smoothing(String),
}

impl PlanError {
    /// How far the plan had come.
    fn progress(&self) -> u8 {
        match self {
            PlanError::Grasp(_) => 0,
            PlanError::Transit(_) => 1,
            PlanError::Smoothing(_) => 2,
        }
    }
}
