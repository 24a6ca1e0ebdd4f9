//! Whether an input fits: refuses what was made for another task, by another robot, or of other rows.

use crate::config::{ChosenRobot, Pipeline};
use crate::data::origin::{Kind, provenance};
use crate::data::{ContentHash, Provenance, weights};
use crate::error::{Error, Result};
use crate::layout::Layout;
use crate::robot::file::built_in::paper_robot;
use crate::scene::Scene;
use crate::tasks::with_layout;
use crate::tensor::NamedTensor;
use serde_json::Value;
use std::path::Path;

/// The key of a provenance's settings that says that what was learned from is a dataset of another program, and which columns.
pub const FOREIGN: &str = "columns";

/// Refuses an input that was made for another task, or for one of the same name that says something else.
///
/// # Errors
/// [`Error::Input`] naming both tasks.
pub fn same_task(path: &Path, made: &Provenance, pipeline: &Pipeline) -> Result<()> {
    let (theirs, ours) = (&made.task, &pipeline.task.name);
    if made.settings.get(FOREIGN).is_some() {
        return Err(Error::input(
            path,
            format!(
                "was learned from {theirs}, a dataset of another program, not from demos of {ours}: hilt has no simulator for it"
            ),
        ));
    }
    if theirs != ours {
        return Err(Error::input(
            path,
            format!("was made for task {theirs}, but task {ours} is asked for; give --task {theirs} or another file"),
        ));
    }
    // The paper's tasks leave it unsaid.
    let same = match made.settings["task"]["content"].as_str() {
        None => pipeline.task.is_of_the_paper(),
        Some(content) => content == pipeline.task.content(),
    };
    if same {
        return Ok(());
    }
    Err(Error::input(path, format!("was made for another task of the name {ours}: its file has changed since; make it anew")))
}

/// Refuses weights of another task or robot than those of a recording: there no flag says which.
///
/// # Errors
/// [`Error::Input`] naming both; what reading returns.
pub fn of_recording(path: &Path, kind: &'static str, scene: &Scene) -> Result<()> {
    let made = provenance(path, Kind::Weights(kind))?;
    let robot = robot_of(&made);
    for (what, theirs, ours) in [("task", &made.task, &scene.task.name), ("robot", &robot, &scene.robot.name)] {
        if theirs != ours {
            return Err(Error::input(path, format!("was made for {what} {theirs}, but the recording is of {what} {ours}")));
        }
    }
    Ok(())
}

/// A network of the robot and task of `pipeline` from its weights: `make` makes it of their tensors and description, `layout` says what its rows hold.
///
/// # Errors
/// What reading returns; [`Error::Input`] for weights of another task, kind or layout, or that are no such network.
pub fn read_network<N>(
    path: &Path,
    kind: &str,
    pipeline: &Pipeline,
    make: fn(&[NamedTensor], &Value) -> std::result::Result<N, String>,
    layout: fn(&N) -> &Layout,
) -> Result<(N, Provenance, ContentHash)> {
    let (tensors, description, made, content) = weights::read_hashed(path, kind)?;
    same_task(path, &made, pipeline)?;
    let network = make(&tensors, &with_layout(description)).map_err(|why| Error::input(path, why))?;
    same_layout(path, &made, layout(&network), pipeline)?;
    Ok((network, made, content))
}

/// The robot that made it; what does not say by whom was made by the paper's, when there was no other.
pub fn robot_of(made: &Provenance) -> String {
    made.settings["robot"]["name"].as_str().map_or_else(|| paper_robot().name.clone(), String::from)
}

/// Whether this robot made it, whatever its files are called.
pub fn made_by(made: &Provenance, robot: &ChosenRobot) -> bool {
    match made.settings["robot"]["content"].as_str() {
        None => robot.is_default(),
        Some(content) => content == robot.content(),
    }
}

/// Refuses what another robot made; what does not say by whom was made by the Jaco, when there was no other.
///
/// # Errors
/// [`Error::Input`] naming both.
pub fn same_robot(path: &Path, made: &Provenance, pipeline: &Pipeline) -> Result<()> {
    if made_by(made, &pipeline.robot) {
        return Ok(());
    }
    let (theirs, ours) = (&robot_of(made), &pipeline.robot.name);
    let hint = if theirs == ours { ", or its files have changed since".to_string() } else { format!("; give --robot {theirs}") };
    Err(Error::input(path, format!("was made by robot {theirs}, but {ours} is asked for{hint}, or make it anew")))
}

/// Refuses rows that are not those of the robot in the task: by the names of the robots that made them, where those differ.
///
/// # Errors
/// [`Error::Input`] with the robots, or the numbers of both.
pub fn same_layout(path: &Path, made: &Provenance, layout: &Layout, pipeline: &Pipeline) -> Result<()> {
    let ours = pipeline.task.layout(&pipeline.robot);
    if *layout == *ours {
        return Ok(());
    }
    same_robot(path, made, pipeline)?;
    let [theirs, ours] =
        [layout, &*ours].map(|l| format!("states of {} numbers and actions of {}", l.state_dim(), l.action_dim()));
    let robot = &pipeline.robot.name;
    let advice = "give --robot, or make it anew";
    Err(Error::input(
        path,
        format!("has {theirs}; {robot} in this task has {ours}, or in another order (\"layout\" says which): {advice}"),
    ))
}
