//! The physics that everything else stands on: grasps by friction, an arm that does as it is told, runs that repeat bit for bit.

mod episode;
mod grasp;
mod replay;
mod robot;
mod scripted;

use hilt::config::SceneSettings;
use hilt::robot::{Arm, LINK_SHAPES, LinkPoses, Shape};
use hilt::scene::{BLOCK_EDGE_M, Scene};
use hilt::sim::{Controller, World};
use hilt::state::Pose;
use hilt::tasks::{Observation, Task, draw_scene};
use nalgebra::{Isometry3, Point3};
use scripted::Script;

/// The scene of random position (and yaw) number `index`.
fn scene(task: Task, index: u64) -> Scene {
    let settings = SceneSettings { yaw: true, ..SceneSettings::default() };
    draw_scene(task, &settings, &mut hilt::seed::stream(7, "physics test", index)).expect("the default spawn area has room")
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
    lowest_of_box(&block.isometry(), [0.0; 3], [BLOCK_EDGE_M / 2.0; 3])
}

/// Height of the lowest point of the arm above its base \[m\].
fn lowest_of_robot(poses: &LinkPoses) -> f64 {
    let moving = LINK_SHAPES.iter().filter(|s| s.link > 1);
    let height = |point: [f64; 3], link: usize| (poses[link] * Point3::from(point)).z;
    moving.fold(f64::INFINITY, |least, s| {
        least.min(match s.shape {
            Shape::Capsule { from_m, to_m, radius_m } => height(from_m, s.link).min(height(to_m, s.link)) - radius_m,
            Shape::Box { center_m, half_m } => lowest_of_box(&poses[s.link], center_m, half_m),
        })
    })
}

fn lowest_of_box(pose: &Isometry3<f64>, center: [f64; 3], half: [f64; 3]) -> f64 {
    // The bits of 0..8 are the signs of the corners.
    let corner = |bits: i32| std::array::from_fn::<f64, 3, _>(|i| center[i] + half[i] * f64::from(2 * ((bits >> i) & 1) - 1));
    (0..8).map(|bits| (pose * Point3::from(corner(bits))).z).fold(f64::INFINITY, f64::min)
}

/// The block as the hand sees it.
fn in_hand(seen: &Observation) -> Pose {
    let hand = Arm::new().tool_pose(&seen.state.q_rad);
    Pose::from_isometry(&(hand.inverse() * seen.state.block.isometry()))
}
