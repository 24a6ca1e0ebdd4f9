//! Control steps per second and core: a whole noisy stack episode, and its hardest part, a block held while the arm moves.
//! Prints a table in Markdown.

mod common;
#[path = "../tests/physics/scripted.rs"]
#[allow(dead_code, reason = "the tests use more of it")]
mod scripted;

use hilt::config::{SceneSettings, SimulateSettings};
use hilt::interrupt::Interrupt;
use hilt::joints::Joints;
use hilt::robot::file::built_in::paper_robot;
use hilt::scene::Scene;
use hilt::sim::{Controller, Disturbance, World, run_episode};
use hilt::task::built_in::stack;
use hilt::tasks::draw_scene;
use scripted::Script;

/// Repetitions of each.
const REPETITIONS: usize = 60;
/// Control steps of a measured stretch: 2 s of simulated time.
const STRETCH: u32 = 40;
/// Joint 1 swings with this speed \[rad/s\]; the fingers keep closing with the other.
const SWING_RAD_S: f64 = 0.3;
const GRIP_RAD_S: f64 = 0.3;

fn stack_scene() -> Scene {
    draw_scene(&paper_robot(), &stack(), &SceneSettings::default(), &mut hilt::seed::stream(0, "bench", 0))
        .expect("the spawn area has room")
}

/// The world with the block in the air, in the hand.
fn holding() -> World {
    let scene = stack_scene();
    let mut world = World::new(&scene);
    let mut script = Script::lift(&scene.objects[0].pose);
    for _ in 0..150 {
        let seen = world.observe();
        world.step(&script.command(&seen));
    }
    assert!(world.observe().gripped(0), "the block is in the hand");
    world
}

fn held_block() -> Vec<f64> {
    let start = holding().snapshot();
    let restored = || World::restore(&start).expect("a snapshot made just now");
    let action = Joints::from_fn(9, |i| match i {
        0 => SWING_RAD_S,
        6.. => GRIP_RAD_S,
        _ => 0.0,
    });
    let stretch =
        |world: &mut World| (0..STRETCH).fold(true, |held, _| (world.step(&action), held & world.observe().gripped(0)).1);
    assert!(stretch(&mut restored()), "the block stays in the hand");
    let mut worlds: Vec<World> = (0..REPETITIONS).map(|_| restored()).collect();
    common::seconds(REPETITIONS, || {
        stretch(&mut worlds.pop().expect("a world each"));
    })
}

fn whole_episode() -> (usize, Vec<f64>) {
    let scene = stack_scene();
    let settings = SimulateSettings::default();
    let run = || {
        let mut script = Script::carry(&scene.objects[0].pose, scene.target_m(0));
        let mut noise = Disturbance::new(&paper_robot(), &settings, hilt::seed::stream(0, "simulate", 0));
        run_episode(0, &scene, &mut script, &mut noise, settings.max_steps, &Interrupt::default()).expect("not interrupted")
    };
    let steps = run().steps.len();
    (steps, common::seconds(REPETITIONS, || drop(run())))
}

fn main() {
    common::head(&["simulation on one core", "control steps", "steps/s, fastest", "steps/s, median"]);
    let row = |name: &str, steps: usize, seconds: &[f64]| {
        let rate = |seconds: f64| steps as f64 / seconds;
        println!("| {name} | {steps} | {:.0} | {:.0} |", rate(seconds[0]), rate(common::median(seconds)));
    };
    row("block held, arm moving", STRETCH as usize, &held_block());
    let (steps, seconds) = whole_episode();
    row("whole stack episode", steps, &seconds);
}
