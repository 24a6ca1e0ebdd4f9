//! Where the hand goes: ready pose, grasp and release candidates, and the heights between them.

use super::path::{Knot, YAW_LEVER_M, knot};
use crate::robot::{Arm, READY_Q_RAD};
use crate::scene::Scene;
use crate::state::Context;
use std::f64::consts::FRAC_PI_2;

/// Height of the tool point over the block's centre in a grasp \[m\]: closed fingertips stay 5 mm above the table.
pub const GRASP_OVER_CENTER_M: f64 = -0.001;
/// Height over the grasp from which the hand comes straight down \[m\]: open fingertips pass above the block.
pub(super) const PREGRASP_RISE_M: f64 = 0.09;
/// Height of the block's centre at the end of a pick-up \[m\]: 3.5 cm above what counts.
pub const LIFTED_CENTER_M: f64 = 0.235;
/// Height over grasp and release at which the block is carried \[m\]: its lower face passes 3 cm above a base block.
pub(super) const CARRY_RISE_M: f64 = 0.08;
/// Gap under the block when it is let go \[m\].
pub const RELEASE_GAP_M: f64 = 0.002;
/// How far the hand retreats upward \[m\].
pub(super) const RETREAT_RISE_M: f64 = 0.09;
/// Quarter turns at which a cube can be held, in order of preference.
const QUARTER_TURNS: [f64; 4] = [0.0, 1.0, -1.0, 2.0];

/// A knot moved straight up.
pub(super) fn raised(at: &Knot, by_m: f64) -> Knot {
    Knot::new(at.x, at.y, at.z + by_m, at.w)
}

/// Where every plan begins.
pub(super) fn ready() -> Knot {
    let tool = Arm::new().tool_pose(&READY_Q_RAD);
    knot(tool.translation.vector.into(), 0.0)
}

/// Level hand poses around the block, nearest to the ready pose's yaw first.
pub(super) fn grasps(scene: &Scene) -> Vec<Knot> {
    let [x, y, z] = scene.block.position_m;
    let yaw = quarter_turn(scene.block.isometry().rotation.euler_angles().2);
    QUARTER_TURNS.map(|k| knot([x, y, z + GRASP_OVER_CENTER_M], yaw + k * FRAC_PI_2)).to_vec()
}

/// Level hand poses that let a block, held at `grasp`, stand at its target: least turning first.
pub(super) fn releases(scene: &Scene, grasp: &Knot) -> Vec<Knot> {
    let aligned = match scene.context {
        Context::None | Context::Goal(_) => 0.0,
        Context::Base(base) => {
            quarter_turn(base.isometry().rotation.euler_angles().2 - scene.block.isometry().rotation.euler_angles().2)
        }
    };
    let [x, y, z] = scene.target_m();
    let yaw = grasp.w / YAW_LEVER_M + aligned;
    QUARTER_TURNS.map(|k| knot([x, y, z + GRASP_OVER_CENTER_M + RELEASE_GAP_M], yaw + k * FRAC_PI_2)).to_vec()
}

/// The least turn that looks the same for a cube, within an eighth of a turn to either side.
fn quarter_turn(yaw: f64) -> f64 {
    yaw - (yaw / FRAC_PI_2).round() * FRAC_PI_2
}
