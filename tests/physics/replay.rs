//! Runs repeat, snapshots continue, recorded states can be set.

use crate::scripted::Script;
use crate::{distance, play, scene};
use hilt::config::SimulateSettings;
use hilt::interrupt::Interrupt;
use hilt::sim::{Controller, Disturbance, World, run_episode};
use hilt::state::State;
use hilt::task::built_in::{pick_and_place, pick_up, stack};
use hilt::tasks::Task;
use std::sync::Arc;

/// Control steps until the scripted block is in the air.
const MID_CARRY: usize = 105;

/// The world in the middle of a carry, and its script.
fn mid_carry(task: &Arc<Task>, index: u64) -> (World, Script) {
    let scene = scene(task, index);
    let mut world = World::new(&scene);
    let mut script = Script::carry(&scene.objects[0].pose, scene.target_m(0));
    for _ in 0..MID_CARRY {
        let seen = world.observe();
        world.step(&script.command(&seen));
    }
    assert!(world.observe().gripped(0), "the block is in the hand");
    (world, script)
}

/// The next `steps` states as bits, of what the script does.
fn future(world: &mut World, script: &mut Script, steps: usize) -> Vec<u32> {
    let mut bits = Vec::new();
    for _ in 0..steps {
        let seen = world.observe();
        bits.extend(seen.state.to_row().iter().map(|v| v.to_bits()));
        bits.extend(seen.contacts.objects[0].fingers_n.iter().map(|f| (*f as f32).to_bits()));
        world.step(&script.command(&seen));
    }
    bits
}

#[test]
fn an_episode_repeats_bit_for_bit_on_any_thread() {
    let run = || {
        let scene = scene(&stack(), 3);
        let mut script = Script::carry(&scene.objects[0].pose, scene.target_m(0));
        let mut noise = Disturbance::new(&scene.robot, &SimulateSettings::default(), hilt::seed::stream(0, "simulate", 3));
        run_episode(3, &scene, &mut script, &mut noise, 300, &Interrupt::default()).expect("not interrupted")
    };
    let here = run();
    let there = std::thread::spawn(run).join().expect("the thread ran");
    assert!(here.steps.len() > 100);
    assert_eq!(here, there);
}

#[test]
fn recorded_actions_reproduce_the_recorded_states() {
    let scene = scene(&pick_up(), 4);
    let mut script = Script::lift(&scene.objects[0].pose);
    let mut noise = Disturbance::new(&scene.robot, &SimulateSettings::default(), hilt::seed::stream(0, "simulate", 4));
    let episode = run_episode(4, &scene, &mut script, &mut noise, 200, &Interrupt::default()).expect("not interrupted");
    let demo = episode.to_demo().expect("a sound episode");
    let mut world = World::new(&scene);
    for t in 0..demo.len() {
        assert_eq!(world.observe().state.to_row(), demo.state(t), "state {t}");
        world.step(&demo.executed()[t * 9..(t + 1) * 9].iter().map(|v| f64::from(*v)).collect());
    }
    assert_eq!(world.observe().state.to_row(), demo.state(demo.len()));
}

#[test]
fn a_snapshot_continues_bit_for_bit() {
    for index in 0..3 {
        let (mut world, mut script) = mid_carry(&stack(), index);
        let bytes = world.snapshot();
        let mut restored = World::restore(&bytes).expect("a snapshot");
        let mut twin = script.clone();
        let (one, other) = (future(&mut world, &mut script, 150), future(&mut restored, &mut twin, 150));
        assert!(one == other, "world {index} continues differently after a snapshot");
    }
}

#[test]
fn a_world_can_move_to_another_thread() {
    let (mut world, mut script) = mid_carry(&pick_and_place(), 0);
    let mut restored = World::restore(&world.snapshot()).expect("a snapshot");
    let mut twin = script.clone();
    let there = std::thread::spawn(move || future(&mut restored, &mut twin, 40)).join().expect("the thread ran");
    assert!(there == future(&mut world, &mut script, 40));
}

#[test]
fn bytes_that_are_no_snapshot_are_refused() {
    let bytes = World::new(&scene(&pick_up(), 0)).snapshot();
    let message = World::restore(&bytes[..bytes.len() / 2]).map(|_| ()).unwrap_err().to_string();
    assert!(message.contains("no snapshot"), "{message}");
}

#[test]
fn a_recorded_state_can_be_set_exactly() {
    for (task, index) in [(pick_up(), 0), (pick_and_place(), 1), (stack(), 2)] {
        let (mut world, mut script) = if task == pick_up() {
            let scene = scene(&task, index);
            let mut world = World::new(&scene);
            let mut script = Script::lift(&scene.objects[0].pose);
            play(&mut world, &mut script, 1);
            (world, script)
        } else {
            mid_carry(&task, index)
        };
        let row = world.observe().state.to_row();
        let recorded = State::from_row(&task, 9, &row).expect("a row of this task");
        let mut set = World::new(&scene(&task, index));
        set.set_state(&recorded);
        let seen = set.observe().state;
        let error = seen.to_row().iter().zip(&row).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(error < 1e-6, "{task}: set with an error of {error}");
        let mut twin = script.clone();
        for _ in 0..20 {
            let (a, b) = (world.observe(), set.observe());
            world.step(&script.command(&a));
            set.step(&twin.command(&b));
        }
        let apart = distance(&world.observe().state.objects[0], &set.observe().state.objects[0]);
        assert!(apart < 3e-3, "{task}: block {apart} m away from the recorded future after 1 s");
        assert!(set.observe().gripped(0), "{task}: dropped after setting the state");
    }
}
