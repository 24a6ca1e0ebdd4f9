//! Time of a complete plan, per task: `cargo bench --bench plan`. Each repetition plans the next of many random scenes, on one thread.
//! Prints a table in Markdown.

mod common;

use hilt::config::{PlanSettings, SceneSettings};
use hilt::plan::Planner;
use hilt::robot::file::built_in::paper_robot;
use hilt::seed::stream;
use hilt::task::built_in::of_the_paper;
use hilt::tasks::draw_scene;

/// Scenes of a task.
const SCENES: usize = 200;
/// Share of the plans that take no longer than the slow one shown.
const SLOW: f64 = 0.95;

fn main() {
    common::head(&["plan", "median ms", "95th percentile ms"]);
    for task in of_the_paper() {
        let mut planner = Planner::new(&paper_robot(), &task, &PlanSettings::default());
        let mut index = 0;
        let seconds = common::seconds(SCENES, || {
            let scene = draw_scene(&paper_robot(), &task, &SceneSettings::default(), &mut stream(0, "scene", index))
                .expect("the default area has room");
            planner.plan(index, &scene, &mut stream(0, "plan", index)).expect("every default scene has a plan");
            index += 1;
        });
        let slow = seconds[(SLOW * SCENES as f64) as usize];
        println!("| {task} | {:.2} | {:.2} |", 1e3 * common::median(&seconds), 1e3 * slow);
    }
}
