//! Pick-and-place. Task: carry the block to a goal on the table. Randomisation: block and goal, at least 10 cm apart.
//! Success: lifted on the way, then within 5 cm of the goal, released, on the table and at rest for 0.5 s.

use super::observation::{Observation, REST_SPEED_M_S};

/// Distance of the block's final position to the goal that counts \[m\] (paper 4.1).
pub const GOAL_TOLERANCE_M: f64 = 0.05;
/// Least distance between spawn and goal \[m\].
pub const MIN_TRAVEL_M: f64 = 0.10;
/// Conditions by name.
pub const CONDITIONS: [&str; 7] = ["reached", "grasped", "lifted", "at_goal", "released", "on_table", "at_rest"];

pub(super) fn goal_conditions(seen: &Observation, goal_m: [f64; 3]) -> [bool; 4] {
    [seen.block_to(goal_m) < GOAL_TOLERANCE_M, seen.released(), seen.contacts.block_table, seen.block_speed_m_s < REST_SPEED_M_S]
}
