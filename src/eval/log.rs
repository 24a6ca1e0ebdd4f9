//! The per-episode log of an evaluation.

use super::Trial;
use crate::scene::Placed;
use crate::table::{Table, Values};
use crate::task::Task;

/// One row per episode: where it started, how it ended, which conditions held at its end.
pub fn to_table(task: &Task, trials: &[Trial]) -> Table {
    let f64s = |pick: &dyn Fn(&Trial) -> f64| Values::F64(trials.iter().map(pick).collect());
    let flags = |pick: &dyn Fn(&Trial) -> bool| Values::Bool(trials.iter().map(pick).collect());
    let i64s = |pick: &dyn Fn(&Trial) -> u64| Values::I64(trials.iter().map(|t| pick(t) as i64).collect());
    let failures = trials.iter().map(|t| t.failure.map_or("", |f| f.name()).to_string()).collect();
    let mut table = Table::default()
        .with(
            "episode",
            "Number of the episode within the evaluation; with the seed it names the random streams.",
            i64s(&|t| t.index),
        )
        .with("success", "Whether the task was solved.", flags(&|t| t.success))
        .with("failure", "Failure class, empty after a success.", Values::Text(failures))
        .with("steps", "Control steps taken, 50 ms each.", i64s(&|t| t.steps))
        .with("reward", "Sum of the milestones' rewards.", f64s(&|t| t.reward))
        .with("hit_obstacle", "Whether a robot link touched an obstacle at any moment.", flags(&|t| t.hit_obstacle));
    for (k, object) in task.objects.iter().enumerate() {
        let name = &object.name;
        let mut add = |part: &str, doc: &str, of: fn(&Placed) -> f64| {
            let values = f64s(&|t| of(&t.scene.objects[k]));
            let whole = std::mem::take(&mut table);
            table = whole.with(&format!("{name}.{part}"), &format!("{doc} of object {name} at the start."), values);
        };
        add("x_m", "Place along x", |o| o.pose.position_m[0]);
        add("y_m", "Place along y", |o| o.pose.position_m[1]);
        if k < task.moved() {
            add("yaw_rad", "Turn about the vertical", |o| o.pose.yaw_rad());
            add("friction", "Coulomb friction", |o| o.friction);
            add("mass_kg", "Mass", |o| o.mass_kg);
        }
    }
    for (k, name) in task.goal_names().iter().enumerate() {
        for (i, axis) in ["x", "y"].into_iter().enumerate() {
            table = table.with(&format!("{name}.{axis}_m"), &format!("The goal, {axis}."), f64s(&|t| t.scene.goals[k][i]));
        }
    }
    for (i, name) in task.condition_names().iter().enumerate() {
        table = table.with(&format!("condition.{name}"), "Whether this condition held at the end.", flags(&|t| t.conditions[i]));
    }
    table
}
