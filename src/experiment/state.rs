//! What of an experiment is done: an artefact that is there and says that it was made with the step's settings and seed from the inputs that
//! are there. Times of files say nothing.

use super::place::checkpoint_of;
use super::runs::Grid;
use super::step::Step;
use crate::config::Stage;
use crate::data::differences::first_difference;
use crate::data::origin::{Kind, origin};
use crate::data::{ContentHash, Provenance, dataset, weights};
use crate::error::{Error, Result};
use rayon::prelude::*;
use std::path::Path;

/// How a step stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Its artefact is there.
    Done,
    /// It can begin.
    Ready,
    /// A step that it needs is not done.
    Waiting,
}

impl State {
    /// The word in lists.
    pub fn name(self) -> &'static str {
        ["done", "ready", "waiting"][self as usize]
    }
}

/// Artefacts of other settings that are named one by one; the rest is counted.
const NAMED: usize = 3;

/// The content of every finished step's artefact, in the order of the steps.
pub type Contents = Vec<Option<ContentHash>>;

/// Looks at every step.
///
/// # Errors
/// [`Error::Failed`] when artefacts of other settings or inputs stand where the experiment's go.
pub fn survey(grid: &Grid) -> Result<Contents> {
    let found: Vec<Option<(Provenance, ContentHash)>> = grid.steps.par_iter().map(found).collect();
    let (mut contents, mut conflicts) = (Contents::new(), Vec::new());
    for (step, found) in grid.steps.iter().zip(found) {
        let checked = match found {
            Some((theirs, content)) => check(step, step.artefact(), &theirs, &contents).map(|whole| whole.then_some(content)),
            None => check_checkpoint(step, &contents).map(|()| None),
        };
        contents.push(checked.unwrap_or_else(|conflict| {
            conflicts.push(conflict);
            None
        }));
    }
    if conflicts.is_empty() {
        return Ok(contents);
    }
    let more = conflicts.len().saturating_sub(NAMED);
    let more = if more > 0 { format!("\nand {more} more") } else { String::new() };
    conflicts.truncate(NAMED);
    Err(Error::Failed(format!(
        "{}{more}\nthe experiment was changed after these were made, and nothing of it is replaced: take the change back, give the experiment another \
         name (a copy of its file) or another directory (--dir), or remove what you no longer want",
        conflicts.join("\n")
    )))
}

/// How each step stands, by what [`survey`] has found.
pub fn states(grid: &Grid, contents: &Contents) -> Vec<State> {
    let ready = |step: &Step| step.needs().all(|from| contents[from].is_some());
    let state = |(i, step): (usize, &Step)| match contents[i] {
        Some(_) => State::Done,
        None if ready(step) => State::Ready,
        None => State::Waiting,
    };
    grid.steps.iter().enumerate().map(state).collect()
}

/// Looks at one step whose inputs are all done; `None` when it is to be run.
///
/// # Errors
/// [`Error::Failed`] when an artefact of other settings or inputs stands in its place.
pub fn look(step: &Step, contents: &Contents) -> Result<Option<ContentHash>> {
    match found(step) {
        Some((theirs, content)) => match check(step, step.artefact(), &theirs, contents) {
            Ok(whole) => Ok(whole.then_some(content)),
            Err(conflict) => Err(Error::Failed(conflict)),
        },
        None => Ok(None),
    }
}

/// The artefact, where it is there and whole. What is damaged is made again: the stage itself refuses to replace what is not its own.
fn found(step: &Step) -> Option<(Provenance, ContentHash)> {
    if !step.artefact().exists() {
        return None;
    }
    origin(step.artefact(), step.outputs[0].kind).ok()
}

/// Whether an artefact at `path` is what the step makes, as far as its inputs are known; otherwise in what it differs.
fn check(step: &Step, path: &Path, theirs: &Provenance, contents: &Contents) -> std::result::Result<bool, String> {
    let mut ours = step.provenance.clone();
    // Where the settings leave it open, the policy says it.
    if step.stage == Stage::Evaluate && ours.settings["evaluate"]["horizon_steps"] == 0 {
        ours.settings["evaluate"]["horizon_steps"] = theirs.settings["evaluate"]["horizon_steps"].clone();
    }
    let mut verified = step.is_there();
    for input in &step.inputs {
        let known = match input.from {
            Some(from) => contents[from],
            None => origin(&input.path, input.kind).ok().map(|(_, content)| content),
        };
        let stated = theirs.inputs.get(input.role).cloned();
        verified &= known.is_some();
        if let Some(hash) = known.map(|content| content.to_string()).or(stated) {
            ours.inputs.insert(input.role.into(), hash);
        }
    }
    match first_difference(theirs, &ours) {
        None => Ok(verified),
        Some(found) => Err(format!("{}: {found}", path.display())),
    }
}

/// A training that was stopped goes on only as what it was.
fn check_checkpoint(step: &Step, contents: &Contents) -> std::result::Result<(), String> {
    let path = checkpoint_of(step.artefact());
    if step.stage != Stage::Train || !path.exists() {
        return Ok(());
    }
    match origin(&path, Kind::Weights(weights::CHECKPOINT)) {
        Ok((theirs, _)) => check(step, &path, &theirs, contents).map(drop),
        Err(why) => Err(format!("{why}; remove the file to begin that training again")),
    }
}

/// The datasets that an experiment names must be there before anything begins.
///
/// # Errors
/// [`Error::Input`] for one that is none, or of another task.
pub fn check_given(grid: &Grid) -> Result<()> {
    let given = grid.steps.iter().flat_map(|step| step.inputs.iter().map(move |input| (step, input)));
    for (step, input) in given.filter(|(_, input)| input.from.is_none()) {
        let made = dataset::provenance(&input.path.join(dataset::TRAIN))?;
        dataset::provenance(&input.path.join(dataset::VALIDATION))?;
        if made.task != step.task {
            let message = format!("is a dataset of {}, the experiment needs one of {}", made.task, step.task);
            return Err(Error::input(&input.path, message));
        }
    }
    Ok(())
}
