//! Where the hand goes: ready pose, grasp and release candidates, and the heights between them.

use super::path::{Knot, YAW_LEVER_M, knot};
use crate::joints::Joints;
use crate::robot::Robot;
use crate::robot::collision::Solid;
use crate::scene::Scene;
use crate::task::Object;
use nalgebra::Translation3;
use std::f64::consts::FRAC_PI_2;

/// Height over the grasp from which the hand comes straight down \[m\]: open fingertips pass above a 5 cm cube.
pub(super) const PREGRASP_RISE_M: f64 = 0.09;
/// How far above what counts an object is lifted \[m\].
const OVER_HEIGHT_M: f64 = 0.035;
/// Height over grasp and release at which an object is carried \[m\]: the lower face of a 5 cm cube passes 3 cm above another.
pub(super) const CARRY_RISE_M: f64 = 0.08;
/// Gap under the object when it is let go \[m\].
pub const RELEASE_GAP_M: f64 = 0.002;
/// How far the hand retreats upward \[m\].
pub(super) const RETREAT_RISE_M: f64 = 0.09;
/// How deep a finger that holds an object is in it, in numbers \[m\]: within the millimetre that contacts of the simulation give way.
const PRESS_M: f64 = 5e-4;
/// Halvings of the way on which a closing finger meets the object: a hundredth of a degree is left.
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

/// Level hand poses around the object of a goal, nearest to the ready pose's yaw first.
pub(super) fn grasps(scene: &Scene, goal: usize) -> Vec<Knot> {
    let number = scene.task.goals[goal].object;
    let pose = scene.objects[number].pose;
    let [x, y, z] = pose.position_m;
    let yaw = quarter_turn(pose.yaw_rad());
    QUARTER_TURNS.map(|k| knot([x, y, z + scene.task.objects[number].grip_m], yaw + k * FRAC_PI_2)).to_vec()
}

/// How much higher than in its grasp an object is in the end of a lift \[m\].
pub(super) fn lift_m(scene: &Scene, goal: usize) -> f64 {
    scene.target_m(goal)[2] + OVER_HEIGHT_M - scene.objects[scene.task.goals[goal].object].pose.position_m[2]
}

/// Level hand poses that let the object of a goal, held at `grasp`, stand at its target: least turning first.
pub(super) fn releases(scene: &Scene, goal: usize, grasp: &Knot) -> Vec<Knot> {
    let number = scene.task.goals[goal].object;
    let own = scene.objects[number].pose.yaw_rad();
    let aligned = quarter_turn(scene.task.goals[goal].kind().yaw_rad(scene, goal) - own);
    let [x, y, z] = scene.target_m(goal);
    let yaw = grasp.w / YAW_LEVER_M + aligned;
    let z = z + scene.task.objects[number].grip_m + RELEASE_GAP_M;
    QUARTER_TURNS.map(|k| knot([x, y, z], yaw + k * FRAC_PI_2)).to_vec()
}

/// The hand in the ready pose, each finger closed as far as an object between them lets it, to a hundredth of a radian.
pub(super) fn closed_around(robot: &Robot, object: &Object) -> Joints {
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
            if presses(robot, joint + 1, &at(share), object) { high = share } else { low = share }
        }
        let hundredths = at(low)[joint] / robot.joints[joint].per_radian() * 100.0;
        let whole = if robot.closing_way(i) > 0.0 { hundredths.floor() } else { hundredths.ceil() };
        closed[joint] = whole / 100.0 * robot.joints[joint].per_radian();
    }
    closed
}

/// Whether a link presses into an object that stands as it is grasped.
fn presses(robot: &Robot, link: usize, q: &Joints, object: &Object) -> bool {
    let poses = robot.link_poses(q);
    let center = robot.tool_of(&poses) * Translation3::new(0.0, 0.0, -object.grip_m);
    let solid = Solid::cuboid(center, object.shape.half_m());
    robot.links[link].shapes.iter().any(|shape| Solid::of(shape, &poses[link]).distance_m(&solid) < -PRESS_M)
}

/// The least turn that looks the same for a cube, within an eighth of a turn to either side.
fn quarter_turn(yaw: f64) -> f64 {
    yaw - (yaw / FRAC_PI_2).round() * FRAC_PI_2
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::file::built_in::{all, paper_robot};
    use crate::task::built_in::pick_up;

    #[test]
    fn fingers_close_as_far_as_the_block_lets_them() {
        let block = &pick_up().objects[0];
        // As measured: a cube of 5 cm stops them at .98 to 1.01 rad.
        assert_eq!(closed_around(&paper_robot(), block)[6], 0.98);
        for robot in all() {
            let closed = closed_around(&robot, block);
            for (i, joint) in robot.fingers().enumerate() {
                let mut farther = closed;
                farther[joint] += 0.02 * robot.joints[joint].per_radian() * robot.closing_way(i).signum();
                let presses = |q: &Joints| presses(&robot, joint + 1, q, block);
                assert!(!presses(&closed) && presses(&farther), "{}: {closed:?}", robot.name);
            }
        }
    }
}
