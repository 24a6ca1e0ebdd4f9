//! Friction alone holds the block: it is lifted, carried, stacked, and slips where there is no friction.

use crate::scripted::Script;
use crate::{distance, in_hand, lowest_corner, play, scene, scene_of};
use hilt::joints::Joints;
use hilt::math::sin_cos;
use hilt::robot::Robot;
use hilt::robot::file::built_in::all;
use hilt::sim::{Controller, World};
use hilt::state::Context;
use hilt::tasks::Task;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Random positions of a sweep.
const POSITIONS: u64 = 12;
/// Control steps of 5 s and 2 s.
const FIVE_SECONDS: usize = 100;
const TWO_SECONDS: usize = 40;
/// The swing of an arm that holds a block \[rad/s\], and its period in control steps.
const SWING_RAD_S: f64 = 0.5;
const SWING_STEPS: f64 = 40.0;
/// Weight of the block \[N\].
const WEIGHT_N: f64 = 0.981;

fn lifted_height(robot: &Arc<Robot>, index: u64, friction: f64) -> f64 {
    let mut scene = scene_of(robot, Task::PickUp, index);
    scene.friction = friction;
    let mut world = World::new(&scene);
    play(&mut world, &mut Script::lift(&scene.block), 60).state.block.position_m[2]
}

#[test]
fn friction_and_nothing_else_lifts_the_block() {
    for (robot, index) in all().flat_map(|robot| (0..POSITIONS).map(move |index| (Arc::clone(&robot), index))) {
        let (rough, slippery) = (lifted_height(&robot, index, 1.0), lifted_height(&robot, index, 0.01));
        let name = &robot.name;
        assert!(rough > 0.2, "{name}, position {index}: friction 1 lifts only to {rough} m");
        assert!(slippery < 0.05, "{name}, position {index}: friction 0.01 lifts to {slippery} m: something welds");
    }
}

/// How far the block moves in the hand while the arm's first joint swings with this amplitude for five seconds \[m\].
fn slip(robot: &Arc<Robot>, index: u64, swing_rad_s: f64) -> f64 {
    let scene = scene_of(robot, Task::PickUp, index);
    let mut world = World::new(&scene);
    let mut script = Script::lift(&scene.block);
    let before = in_hand(&play(&mut world, &mut script, 40));
    for t in 0..FIVE_SECONDS {
        let seen = world.observe();
        let mut action = script.command(&seen);
        if swing_rad_s > 0.0 {
            action[..robot.arm].fill(0.0);
            action[0] = swing_rad_s * sin_cos(TAU * t as f64 / SWING_STEPS).0;
        }
        world.step(&action);
    }
    distance(&before, &in_hand(&world.observe()))
}

#[test]
fn a_held_block_slips_less_than_a_millimetre_in_five_seconds() {
    for robot in all() {
        for index in 0..POSITIONS {
            let slip = slip(&robot, index, 0.0);
            assert!(slip < 1e-3, "{}, position {index}: slipped {slip} m", robot.name);
        }
    }
}

/// Measured: the paper's robot shifts it by up to 8 mm along its fingers.
#[test]
fn a_swinging_arm_keeps_what_it_holds() {
    for robot in all() {
        for index in 0..POSITIONS / 3 {
            let slip = slip(&robot, index, SWING_RAD_S);
            assert!(slip < 1e-2, "{}, position {index}: shifted by {slip} m", robot.name);
        }
    }
}

#[test]
fn a_placed_block_rests_and_a_stacked_block_stays() {
    for (robot, task) in all().flat_map(|robot| [Task::PickAndPlace, Task::Stack].map(|task| (Arc::clone(&robot), task))) {
        for index in 0..POSITIONS {
            let scene = scene_of(&robot, task, index);
            let mut world = World::new(&scene);
            let mut script = Script::carry(&scene.block, scene.target_m());
            let then = play(&mut world, &mut script, 20);
            let error = (nalgebra::Vector3::from(then.state.block.position_m) - nalgebra::Vector3::from(scene.target_m())).norm();
            let name = &robot.name;
            assert!(error < 0.015, "{name}, {task} {index}: placed {error} m from the target");
            assert!(then.released(), "{name}, {task} {index}: not released");
            assert_eq!(then.contacts.block_base, task == Task::Stack, "{name}, {task} {index}: contact with the base block");
            assert_eq!(then.contacts.block_table, task == Task::PickAndPlace, "{name}, {task} {index}: contact with the table");
            for _ in 0..TWO_SECONDS {
                world.step(&Joints::zeros(robot.joints.len()));
            }
            let moved = distance(&then.state.block, &world.observe().state.block);
            assert!(moved < 1e-4, "{name}, {task} {index}: moved {moved} m in 2 s");
        }
    }
}

#[test]
fn contact_forces_tell_a_grasp_and_a_release() {
    let scene = scene(Task::PickAndPlace, 0);
    let mut world = World::new(&scene);
    let mut script = Script::carry(&scene.block, scene.target_m());
    let mut carried = 0;
    for _ in 0..400 {
        let seen = world.observe();
        let [thumb, left, right] = seen.contacts.finger_block_n[..] else { panic!("three fingers") };
        match script.at {
            0 => assert!(seen.released() && !seen.gripped() && seen.contacts.block_table, "before the grasp"),
            3 | 4 if seen.state.block.position_m[2] > 0.035 => {
                carried += 1;
                assert!(seen.gripped() && !seen.released() && !seen.contacts.block_table, "carrying: {:?}", seen.contacts);
                // Finger 1 is the thumb: it alone presses against the other two.
                assert!((thumb - left - right).abs() < 0.25 * thumb, "thumb {thumb} N against {left} N and {right} N");
                assert!(thumb > 5.0 * WEIGHT_N, "a grip of {thumb} N");
            }
            7 if seen.tool_m[2] > 0.1 => {
                assert!(seen.released() && !seen.gripped() && seen.contacts.block_table, "after the release");
            }
            _ => {}
        }
        world.step(&script.command(&seen));
    }
    assert!(carried > 20, "carried for {carried} steps only");
}

#[test]
fn a_resting_block_stands_where_the_scene_has_it() {
    let scene = scene(Task::Stack, 0);
    let Context::Base(base) = scene.context else { panic!("a stack scene has a base block") };
    let mut world = World::new(&scene);
    let first = world.observe();
    assert!(first.contacts.block_table && !first.contacts.block_base && !first.contacts.robot_table);
    for _ in 0..TWO_SECONDS {
        world.step(&[0.0; 9].into());
    }
    let last = world.observe();
    assert!(distance(&scene.block, &last.state.block) < 1e-4, "the block moved by itself");
    assert!(distance(&base, &last.base_now.expect("stack has a base block")) < 1e-4, "the base block moved by itself");
    assert!(lowest_corner(&last.state.block).abs() < 1e-4);
    assert!(last.contacts.block_table && last.block_speed_m_s < 1e-3);
}
