//! Stack. Task: put the block on the base block. Randomisation: where the block stands; the base block is fixed.
//! Success: resting on the base block alone, released by all fingers and at rest for 0.5 s.

use super::observation::{Observation, REST_SPEED_M_S};
use crate::math::hypot;
use crate::scene::BLOCK_EDGE_M;

/// Horizontal offset of the two centres up to which a block rests on the other \[m\]: half an edge.
pub const ALIGNED_M: f64 = BLOCK_EDGE_M / 2.0;
/// The block's centre sits one edge above the base's, give or take this \[m\].
const LEVEL_M: f64 = 0.01;
/// Height of the block's centre that earns the lift milestone \[m\]: its lower face is above the base block.
pub const LIFT_HEIGHT_M: f64 = 0.10;
/// Conditions by name.
pub const CONDITIONS: [&str; 6] = ["reached", "grasped", "lifted", "on_base", "released", "at_rest"];

pub(super) fn goal_conditions(seen: &Observation) -> [bool; 3] {
    let on_base = seen.base_now.is_some_and(|base| {
        let [dx, dy, dz] = std::array::from_fn(|i| seen.state.block.position_m[i] - base.position_m[i]);
        hypot(dx, dy) < ALIGNED_M && (dz - BLOCK_EDGE_M).abs() < LEVEL_M
    });
    [on_base && seen.contacts.block_base && !seen.contacts.block_table, seen.released(), seen.block_speed_m_s < REST_SPEED_M_S]
}
