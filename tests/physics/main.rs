//! The physics that everything else stands on: grasps by friction, an arm that does as it is told, runs that repeat bit for bit.

mod episode;
mod grasp;
mod replay;
mod robot;
mod scripted;

use hilt::config::SceneSettings;
use hilt::robot::Robot;
use hilt::robot::file::built_in::paper_robot;
use hilt::scene::Scene;
use hilt::sim::{Controller, World};
use hilt::state::Pose;
use hilt::tasks::{Observation, Task, draw_scene};
use nalgebra::{Isometry3, Point3};
use scripted::Script;
use std::sync::Arc;

/// Half of the block's edges \[m\].
const HALF_M: [f64; 3] = [0.025; 3];

/// The scene of random position (and yaw) number `index`, with the paper's robot.
fn scene(task: &Arc<Task>, index: u64) -> Scene {
    scene_of(&paper_robot(), task, index)
}

/// The same with another.
fn scene_of(robot: &Arc<Robot>, task: &Arc<Task>, index: u64) -> Scene {
    let settings = SceneSettings { yaw: true, ..SceneSettings::default() };
    draw_scene(robot, task, &settings, &mut hilt::seed::stream(7, "physics test", index))
        .expect("the default spawn area has room")
}

/// Lets `script` run until it has been on its last leg for `rest` steps, at most 400 steps; returns what is seen then.
fn play(world: &mut World, script: &mut Script, rest: usize) -> Observation {
    let mut rested = 0;
    for _ in 0..400 {
        let seen = world.observe();
        rested += usize::from(script.on_last_leg());
        if rested > rest {
            break;
        }
        world.step(&script.command(&seen));
    }
    world.observe()
}

/// Distance of two positions \[m\].
fn distance(a: &Pose, b: &Pose) -> f64 {
    (a.isometry().translation.vector - b.isometry().translation.vector).norm()
}

/// Height of the lowest corner of a cube \[m\].
fn lowest_corner(block: &Pose) -> f64 {
    lowest_of_box(&block.isometry(), [0.0; 3], HALF_M)
}

/// Height of the lowest point of the robot above its shoulder's link \[m\].
fn lowest_of_robot(poses: &[Isometry3<f64>]) -> f64 {
    let moving = paper_robot().solids(poses).into_iter().filter(|(link, _)| *link > 1);
    moving.map(|(_, solid)| solid.lowest_m()).fold(f64::INFINITY, f64::min)
}

fn lowest_of_box(pose: &Isometry3<f64>, center: [f64; 3], half: [f64; 3]) -> f64 {
    // The bits of 0..8 are the signs of the corners.
    let corner = |bits: i32| std::array::from_fn::<f64, 3, _>(|i| center[i] + half[i] * f64::from(2 * ((bits >> i) & 1) - 1));
    (0..8).map(|bits| (pose * Point3::from(corner(bits))).z).fold(f64::INFINITY, f64::min)
}

/// The block as the hand sees it.
fn in_hand(seen: &Observation) -> Pose {
    let hand = seen.robot.tool_pose(&seen.state.q);
    Pose::from_isometry(&(hand.inverse() * seen.state.objects[0].isometry()))
}
