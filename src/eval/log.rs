//! The per-episode log of an evaluation.

use super::Trial;
use crate::scene::Scene;
use crate::table::{Table, Values};
use crate::task::Task;

/// One row per episode: where it started, how it ended, which conditions held at its end.
pub fn to_table(task: Task, trials: &[Trial]) -> Table {
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
        .with("hit_obstacle", "Whether a robot link touched an obstacle at any moment.", flags(&|t| t.hit_obstacle))
        .with("block.x_m", "Where the block stood at the start, x.", f64s(&|t| t.scene.block.position_m[0]))
        .with("block.y_m", "Where the block stood at the start, y.", f64s(&|t| t.scene.block.position_m[1]))
        .with("block.yaw_rad", "How the block was turned about the vertical at the start.", f64s(&|t| yaw(&t.scene)))
        .with("friction", "Coulomb friction of the block against everything.", f64s(&|t| t.scene.friction))
        .with("block.mass_kg", "Mass of the block.", f64s(&|t| t.scene.block_mass_kg));
    let target = match task {
        Task::PickUp => None,
        Task::PickAndPlace => Some(("goal", "The goal")),
        Task::Stack => Some(("base", "Where the base block stood at the start")),
    };
    if let Some((name, doc)) = target {
        for (i, axis) in ["x", "y"].into_iter().enumerate() {
            let values = f64s(&|t| t.scene.target_m()[i]);
            table = table.with(&format!("{name}.{axis}_m"), &format!("{doc}, {axis}."), values);
        }
    }
    for (i, name) in task.condition_names().iter().enumerate() {
        table = table.with(&format!("condition.{name}"), "Whether this condition held at the end.", flags(&|t| t.conditions[i]));
    }
    table
}

fn yaw(scene: &Scene) -> f64 {
    scene.block.isometry().rotation.euler_angles().2
}
