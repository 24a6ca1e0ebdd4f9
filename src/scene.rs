//! A scene: what stands where when an episode begins. Drawn once per episode, recorded with it.

use crate::robot::Robot;
use crate::robot::file::built_in::paper_robot;
use crate::state::{Context, Pose};
use crate::task::Task;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Edge of every block \[m\] (paper 4.1: cubes of 5 cm).
pub const BLOCK_EDGE_M: f64 = 0.05;

/// An axis-aligned box that stands in the workspace, fixed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Obstacle {
    /// Centre x y z \[m\].
    pub center_m: [f64; 3],
    /// Full edge lengths x y z \[m\].
    pub size_m: [f64; 3],
}

/// The scene of one episode. The table's top is the plane z = 0; the robot's foot stands at the origin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Who acts. Not part of its JSON, which stands beside every plan: whoever reads that says whose plans they are.
    #[serde(skip, default = "paper_robot")]
    pub robot: Arc<Robot>,
    /// The task.
    pub task: Task,
    /// Where the block to move stands at the start.
    pub block: Pose,
    /// Goal or base block.
    pub context: Context,
    /// Fixed boxes to keep clear of.
    pub obstacles: Vec<Obstacle>,
    /// Coulomb friction of the block against everything.
    pub friction: f64,
    /// Mass of the block \[kg\].
    pub block_mass_kg: f64,
}
