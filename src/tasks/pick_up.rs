//! Pick-up. Task: lift the block to 20 cm. Randomisation: where the block stands. Success: at height and gripped for 0.5 s
//! (a throw is no success).

use super::observation::Observation;

/// Height of the block's centre above the table that counts \[m\] (paper 4.1).
pub const TARGET_HEIGHT_M: f64 = 0.20;
/// Conditions by name.
pub const CONDITIONS: [&str; 5] = ["reached", "grasped", "lifted", "at_height", "gripped"];

pub(super) fn goal_conditions(seen: &Observation) -> [bool; 2] {
    [seen.state.block.position_m[2] >= TARGET_HEIGHT_M, seen.gripped()]
}
