//! Where the hand goes: ready pose, grasp and release candidates, and the heights between them.

use super::path::{Knot, YAW_LEVER_M, knot};
use crate::joints::Joints;
use crate::robot::Robot;
use crate::robot::collision::Solid;
use crate::scene::{BLOCK_EDGE_M, Scene};
use crate::state::Context;
use nalgebra::Translation3;
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
/// How deep a finger that holds a block is in it, in numbers \[m\]: within the millimetre that contacts of the simulation give way.
const PRESS_M: f64 = 5e-4;
/// Halvings of the way on which a closing finger meets the block: a hundredth of a degree is left.
const CLOSING_ROUNDS: usize = 14;
/// Quarter turns at which a cube can be held, in order of preference.
const QUARTER_TURNS: [f64; 4] = [0.0, 1.0, -1.0, 2.0];

/// A knot moved straight up.
pub(super) fn raised(at: &Knot, by_m: f64) -> Knot {
    Knot::new(at.x, at.y, at.z + by_m, at.w)
}

/// Where every plan begins.
pub(super) fn ready(robot: &Robot) -> Knot {
    let tool = robot.tool_pose(&robot.ready);
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

/// The hand in the ready pose, each finger closed as far as a block between them lets it, to a hundredth of a radian.
pub(super) fn closed_on_block(robot: &Robot) -> Joints {
    let mut closed = robot.ready;
    for (i, joint) in robot.fingers().enumerate() {
        let at = |share: f64| {
            let mut q = robot.ready;
            q[joint] += share * robot.closing_way(i);
            q
        };
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..CLOSING_ROUNDS {
            let share = (low + high) / 2.0;
            if presses_block(robot, joint + 1, &at(share)) { high = share } else { low = share }
        }
        let hundredths = at(low)[joint] / robot.joints[joint].per_radian() * 100.0;
        let whole = if robot.closing_way(i) > 0.0 { hundredths.floor() } else { hundredths.ceil() };
        closed[joint] = whole / 100.0 * robot.joints[joint].per_radian();
    }
    closed
}

/// Whether a link presses into a block that stands as it is grasped.
fn presses_block(robot: &Robot, link: usize, q: &Joints) -> bool {
    let poses = robot.link_poses(q);
    let center = robot.tool_of(&poses) * Translation3::new(0.0, 0.0, -GRASP_OVER_CENTER_M);
    let block = Solid::cuboid(center, [BLOCK_EDGE_M / 2.0; 3]);
    robot.links[link].shapes.iter().any(|shape| Solid::of(shape, &poses[link]).distance_m(&block) < -PRESS_M)
}

/// The least turn that looks the same for a cube, within an eighth of a turn to either side.
fn quarter_turn(yaw: f64) -> f64 {
    yaw - (yaw / FRAC_PI_2).round() * FRAC_PI_2
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::file::built_in::{all, paper_robot};

    #[test]
    fn fingers_close_as_far_as_the_block_lets_them() {
        // As measured: a cube of 5 cm stops them at .98 to 1.01 rad.
        assert_eq!(closed_on_block(&paper_robot())[6], 0.98);
        for robot in all() {
            let closed = closed_on_block(&robot);
            for (i, joint) in robot.fingers().enumerate() {
                let mut farther = closed;
                farther[joint] += 0.02 * robot.joints[joint].per_radian() * robot.closing_way(i).signum();
                let presses = |q: &Joints| presses_block(&robot, joint + 1, q);
                assert!(!presses(&closed) && presses(&farther), "{}: {closed:?}", robot.name);
            }
        }
    }
}
