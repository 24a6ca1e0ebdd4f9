//! The motors: each moves its own joint, tracks its command, and stays within its limits; abuse breaks nothing.

use crate::scripted::Script;
use crate::{lowest_corner, lowest_of_robot, play, scene};
use hilt::config::SimulateSettings;
use hilt::joints::Joints;
use hilt::math::sin_cos;
use hilt::robot::file::built_in::paper_robot;
use hilt::scene::{Obstacle, Scene};
use hilt::sim::{Controller, Disturbance, World};
use hilt::state::{Action, CONTROL_DT_S};
use hilt::task::built_in::{pick_up, stack};
use hilt::tasks::Observation;
use rand::RngExt;
use std::f64::consts::PI;

/// Tracking error of a free motion in one control step \[rad\].
const TRACKING_RAD: f64 = 1e-3;
/// Dry friction may hold a finger that is commanded slower than this \[rad/s\].
const STICTION_RAD_S: f64 = 0.15;

/// Joints of the Jaco, and of its arm.
const JOINTS: usize = 9;
const ARM_JOINTS: usize = 6;

fn velocities() -> Joints {
    paper_robot().joints.iter().map(|joint| joint.velocity).collect()
}

fn step(world: &mut World, action: &Action) -> Observation {
    world.step(action);
    world.observe()
}

/// A scene whose block is out of the arm's way.
fn empty() -> Scene {
    let mut scene = scene(&pick_up(), 0);
    scene.objects[0].pose.position_m = [0.1, 0.7, 0.025];
    scene
}

#[test]
fn each_joint_answers_to_its_own_command_alone() {
    for joint in 0..JOINTS {
        let mut world = World::new(&empty());
        let before = world.observe().state.q;
        let mut action = Joints::zeros(JOINTS);
        action[joint] = 0.3;
        for _ in 0..10 {
            world.step(&action);
        }
        let seen = world.observe().state;
        for other in 0..JOINTS {
            let expected = if other == joint { 0.3 * 10.0 * CONTROL_DT_S } else { 0.0 };
            let moved = seen.q[other] - before[other];
            assert!((moved - expected).abs() < TRACKING_RAD, "joint {joint} driven: joint {other} moved {moved} rad");
            assert!((seen.dq[other] - action[other]).abs() < 1e-2, "joint {other} turns at {} rad/s", seen.dq[other]);
        }
    }
}

/// Commands as a plan under noise has them: 80 % of the velocity limits within 2 s swings, plus N(0, 0.001).
#[test]
fn free_motion_tracks_its_command_in_one_step() {
    let mut noise = Disturbance::new(&paper_robot(), &SimulateSettings::default(), hilt::seed::stream(0, "tracking", 0));
    let mut world = World::new(&empty());
    let mut before = world.observe().state.q;
    let (mut still, limits) = ([false; JOINTS], velocities());
    for t in 0..200 {
        let swing = 0.8 * sin_cos(PI * f64::from(t) * CONTROL_DT_S).0;
        let action = noise.apply(&limits.map(|limit| swing * limit));
        let after = step(&mut world, &action).state.q;
        for i in 0..JOINTS {
            let (moved, asked) = (after[i] - before[i], CONTROL_DT_S * action[i]);
            if i >= ARM_JOINTS && (action[i].abs() < STICTION_RAD_S || still[i]) {
                // Dry friction: a slow finger may stand, but it never runs ahead of its command.
                assert!(
                    (moved - asked).abs() <= asked.abs().max(STICTION_RAD_S * CONTROL_DT_S),
                    "finger {i} moved {moved} rad, asked {asked}"
                );
            } else {
                assert!((moved - asked).abs() < TRACKING_RAD, "step {t}: joint {i} moved {moved} rad, asked {asked}");
            }
            still[i] = action[i].abs() < STICTION_RAD_S;
        }
        before = after;
    }
}

#[test]
fn joints_stop_at_their_limits() {
    for joint in [1, 2, 6, 7, 8] {
        for sign in [-1.0, 1.0] {
            let mut world = World::new(&empty());
            let mut action = Joints::zeros(JOINTS);
            action[joint] = sign * velocities()[joint];
            for _ in 0..160 {
                let q = step(&mut world, &action).state.q[joint];
                let [low, high] = paper_robot().joints[joint].limits;
                assert!(q > low - 0.05 && q < high + 0.05, "joint {joint} at {q} rad, limits {low}..{high}");
            }
        }
    }
}

#[test]
fn a_stalled_finger_pushes_no_harder_than_its_torque_allows() {
    let scene = scene(&pick_up(), 1);
    let mut world = World::new(&scene);
    play(&mut world, &mut Script::lift(&scene.objects[0].pose), 20);
    let squeeze = |rad_s: f64| {
        let mut world = World::restore(&world.snapshot()).expect("a snapshot");
        let action = Joints::from_fn(JOINTS, |i| if i < ARM_JOINTS { 0.0 } else { rad_s });
        (0..20).for_each(|_| world.step(&action));
        world.observe().contacts.objects[0].fingers_n[0]
    };
    let (soft, hard) = (squeeze(0.1), squeeze(1.0));
    assert!((soft - hard).abs() < 0.05 * hard, "the force follows the commanded speed: {soft} N, {hard} N");
    // 1.2 N m on a lever of 5 to 9 cm.
    assert!(hard > 1.2 / 0.09 * 0.5 && hard < 1.2 / 0.05, "thumb presses with {hard} N");
}

#[test]
fn ramming_the_block_into_the_table_breaks_nothing() {
    let scene = scene(&pick_up(), 2);
    let mut world = World::new(&scene);
    let mut script = Script::lift(&scene.objects[0].pose);
    script.legs[0].tool_m[2] = 0.12;
    script.legs[1].tool_m[2] = -0.15;
    let mut deepest: f64 = 0.0;
    let mut touched = false;
    for _ in 0..160 {
        let seen = world.observe();
        touched |= seen.contacts.robot_table;
        deepest = deepest.min(lowest_corner(&seen.state.objects[0])).min(lowest_of_robot(&world.link_poses()));
        assert!(seen.state.q.iter().chain(&seen.state.dq).all(|v| v.is_finite()));
        world.step(&script.command(&seen));
    }
    assert!(touched, "the hand never reached the table");
    assert!(deepest > -0.02, "something is {deepest} m deep in the table");
}

#[test]
fn random_actions_break_nothing() {
    for seed in 0..4 {
        let mut rng = hilt::seed::stream(seed, "abuse", 0);
        let (mut world, limits) = (World::new(&scene(&stack(), seed)), velocities());
        let mut action = Joints::zeros(JOINTS);
        let (mut deepest, mut overshoot): (f64, f64) = (0.0, 0.0);
        for t in 0..300 {
            if t % 10 == 0 {
                action = Joints::from_fn(JOINTS, |i| limits[i] * (2.0 * rng.random::<f64>() - 1.0));
            }
            let seen = step(&mut world, &action);
            assert!(seen.state.q.iter().chain(&seen.state.objects[0].to_array()).all(|v| v.is_finite()));
            deepest = deepest.min(lowest_corner(&seen.state.objects[0])).min(lowest_of_robot(&world.link_poses()));
            for (q, joint) in seen.state.q.iter().zip(&paper_robot().joints) {
                let [low, high] = joint.limits;
                overshoot = overshoot.max(low - q).max(q - high);
            }
        }
        assert!(deepest > -0.03, "seed {seed}: something is {deepest} m deep in the table");
        assert!(overshoot < 0.15, "seed {seed}: a joint is {overshoot} rad over its limit");
    }
}

#[test]
fn touching_an_obstacle_is_seen() {
    let mut scene = empty();
    scene.obstacles = vec![Obstacle { center_m: [0.45, 0.25, 0.2], size_m: [0.3, 0.1, 0.4] }];
    for (speed, expected) in [(0.5, false), (-0.5, true), (0.0, false)] {
        let mut world = World::new(&scene);
        let mut action = Joints::zeros(JOINTS);
        action[0] = speed;
        let touched = (0..40).any(|_| step(&mut world, &action).contacts.robot_obstacle);
        assert_eq!(touched, expected, "joint 1 at {speed} rad/s");
    }
}
