//! Control steps per second and core: a whole noisy stack episode, and its hardest part, a block held while the arm moves.

#[path = "../tests/physics/scripted.rs"]
#[allow(dead_code, reason = "the tests use more of it")]
mod scripted;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use hilt::config::{SceneSettings, SimulateSettings};
use hilt::interrupt::Interrupt;
use hilt::scene::Scene;
use hilt::sim::{Controller, Disturbance, World, run_episode};
use hilt::state::{ARM_JOINTS, Action};
use hilt::tasks::{Task, draw_scene};
use scripted::Script;

/// Control steps of a measured stretch: 2 s of simulated time.
const STRETCH: u32 = 40;
/// Joint 1 swings with this speed \[rad/s\]; the fingers keep closing with the other.
const SWING_RAD_S: f64 = 0.3;
const GRIP_RAD_S: f64 = 0.3;

fn stack_scene() -> Scene {
    draw_scene(Task::Stack, &SceneSettings::default(), &mut hilt::seed::stream(0, "bench", 0)).expect("the spawn area has room")
}

/// The world with the block in the air, in the hand.
fn holding() -> World {
    let scene = stack_scene();
    let mut world = World::new(&scene);
    let mut script = Script::lift(&scene.block);
    for _ in 0..150 {
        let seen = world.observe();
        world.step(&script.command(&seen));
    }
    assert!(world.observe().gripped(), "the block is in the hand");
    world
}

fn held_block(c: &mut Criterion) {
    let start = holding().snapshot();
    let restored = || World::restore(&start).expect("a snapshot made just now");
    let action: Action = std::array::from_fn(|i| match i {
        0 => SWING_RAD_S,
        ARM_JOINTS.. => GRIP_RAD_S,
        _ => 0.0,
    });
    let stretch =
        |world: &mut World| (0..STRETCH).fold(true, |held, _| (world.step(&action), held & world.observe().gripped()).1);
    assert!(stretch(&mut restored()), "the block stays in the hand");
    let mut group = c.benchmark_group("control steps");
    group.throughput(Throughput::Elements(u64::from(STRETCH)));
    group.bench_function("held block, arm moving", |b| {
        b.iter_batched(restored, |mut world| stretch(&mut world), BatchSize::SmallInput);
    });
    group.finish();
}

fn whole_episode(c: &mut Criterion) {
    let scene = stack_scene();
    let settings = SimulateSettings::default();
    let run = || {
        let mut script = Script::carry(&scene.block, scene.target_m());
        let mut noise = Disturbance::new(&settings, hilt::seed::stream(0, "simulate", 0));
        run_episode(0, &scene, &mut script, &mut noise, settings.max_steps, &Interrupt::default()).expect("not interrupted")
    };
    let steps = run().steps.len();
    let mut group = c.benchmark_group("control steps");
    group.throughput(Throughput::Elements(steps as u64));
    group.bench_function("whole stack episode", |b| b.iter(run));
    group.finish();
}

criterion_group!(benches, held_block, whole_episode);
criterion_main!(benches);
