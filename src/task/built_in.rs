//! The tasks that come with hilt: `[task]` of pipeline files that the binary carries.

use super::Task;
use crate::words::unknown;
use std::sync::{Arc, LazyLock};

/// The pipeline file of each, in the order of lists: the paper's three (section 4.1) first.
const FILES: [(&str, &str); 6] = [
    ("pick-up", include_str!("../../pipelines/pick-up.toml")),
    ("pick-and-place", include_str!("../../pipelines/pick-and-place.toml")),
    ("stack", include_str!("../../pipelines/stack.toml")),
    ("tower", include_str!("../../pipelines/tower.toml")),
    ("sort", include_str!("../../pipelines/sort.toml")),
    ("bin", include_str!("../../pipelines/bin.toml")),
];
/// How many of them are the paper's.
const OF_THE_PAPER: usize = 3;

/// Their names.
pub fn names() -> Vec<&'static str> {
    FILES.map(|(name, _)| name).to_vec()
}

/// The pipeline file of the task of this name.
pub fn pipeline_text(name: &str) -> Option<&'static str> {
    FILES.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}

/// The task of this name.
///
/// # Errors
/// Which names there are, and which was meant.
pub fn find(name: &str) -> Result<Arc<Task>, String> {
    all().into_iter().find(|task| task.name == name).ok_or_else(|| unknown("task", name, &names()))
}

/// All of them.
pub fn all() -> Vec<Arc<Task>> {
    static TASKS: LazyLock<Vec<Arc<Task>>> =
        LazyLock::new(|| FILES.iter().map(|(_, text)| Arc::new(of_pipeline(text))).collect());
    TASKS.clone()
}

/// The paper's three: pick-up, pick-and-place, stack.
pub fn of_the_paper() -> [Arc<Task>; 3] {
    let mut all = all();
    all.truncate(OF_THE_PAPER);
    all.try_into().expect("there are as many")
}

/// Lift the block to 20 cm and hold it.
pub fn pick_up() -> Arc<Task> {
    let [pick_up, ..] = of_the_paper();
    pick_up
}

/// Carry the block to a goal on the table and release it there.
pub fn pick_and_place() -> Arc<Task> {
    let [_, pick_and_place, _] = of_the_paper();
    pick_and_place
}

/// Put the block on the base block and release it.
pub fn stack() -> Arc<Task> {
    let [.., stack] = of_the_paper();
    stack
}

fn of_pipeline(text: &str) -> Task {
    let file: toml::Table = text.parse().expect("a pipeline file that comes with hilt is TOML");
    file["task"].clone().try_into().expect("and has a task")
}
