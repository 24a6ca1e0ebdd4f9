//! How long an animation of 90 pictures of 480 x 360 pixels takes on one thread: what `hilt render --gif` does after reading the recording.
//!
//! `cargo bench --bench gif`; `taskset -c 0` for one core.

mod common;

use common::{head, median, seconds};
use hilt::config::Pipeline;
use hilt::demo::Episode;
use hilt::interrupt::Interrupt;
use hilt::plan::Planner;
use hilt::report::render::{GifOptions, write_gif};
use hilt::seed::stream;
use hilt::sim::{Disturbance, Follower, run_episode};
use hilt::task::built_in::stack;
use hilt::tasks::draw_scene;

/// Pictures of the animation.
const PICTURES: usize = 90;
/// Times that it is made.
const REPEATS: usize = 7;

/// A demonstration that stands still at its end for as long as the animation lasts.
fn episode(steps: usize) -> Episode {
    let pipeline = Pipeline::defaults(&stack());
    let (robot, task) = (&pipeline.robot, &pipeline.task);
    let scene = draw_scene(robot, task, &pipeline.scene, &mut stream(0, "bench.scene", 0)).expect("a scene");
    let plan = Planner::new(robot, task, &pipeline.plan).plan(0, &scene, &mut stream(0, "bench.plan", 0)).expect("a plan");
    let mut follower = Follower::new(&plan).expect("a follower");
    let mut noise = Disturbance::new(robot, &pipeline.simulate, stream(0, "bench.noise", 0));
    let mut episode = run_episode(0, &scene, &mut follower, &mut noise, steps as u32, &Interrupt::default()).expect("an episode");
    episode.steps.resize(steps, episode.last.clone());
    episode
}

fn main() {
    let options = GifOptions::default();
    let steps = (PICTURES - 1) * options.every_n_steps as usize;
    let episode = episode(steps);
    let mut bytes = Vec::new();
    let taken = seconds(REPEATS, || {
        bytes.clear();
        write_gif(&episode, &options, &Interrupt::default(), &mut bytes).expect("an animation");
    });
    head(&["pictures", "size", "fastest s", "median s", "bytes"]);
    println!(
        "| {PICTURES} | {} x {} | {:.3} | {:.3} | {} |",
        options.width,
        options.height,
        taken[0],
        median(&taken),
        bytes.len()
    );
}
