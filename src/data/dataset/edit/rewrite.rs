//! The one loop behind all of it: episodes of the inputs in their order, each into the parts that take it.

use super::Input;
use crate::data::dataset::cells::{Cells, Kind};
use crate::data::dataset::features::{EPISODE, Feature, INDEX, TASK, TIMESTAMP, timestamp_at};
use crate::data::dataset::foreign::{self, Frames, STAGE};
use crate::data::dataset::meta::About;
use crate::data::dataset::sizes::Sizes;
use crate::data::dataset::write::{Episode, Filling, Form};
use crate::data::{Provenance, atomic};
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use crate::words::shown;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// What is done.
pub struct Plan {
    /// Its name and what it was told, for the provenance.
    pub said: Value,
    /// Seed of what was drawn.
    pub seed: u64,
    /// Columns that are left out.
    pub dropped: Vec<String>,
    /// Whether numbers of double precision become single, and timestamps what LeRobot expects.
    pub normalise: bool,
}

/// A dataset that is written.
pub struct Part {
    /// Folder below the place that is written; empty for the place itself.
    pub folder: &'static str,
    /// Of each input, whether each episode goes into it.
    pub takes: Vec<Vec<bool>>,
}

/// Writes the parts below `out`, all or none.
///
/// # Errors
/// [`Error::Input`] when the inputs do not go together or have columns that cannot be written; what reading and writing return;
/// [`Error::Interrupted`].
pub fn write(out: &Path, inputs: &[Input], plan: &Plan, parts: &[Part], interrupt: &Interrupt) -> Result<()> {
    check(inputs, plan)?;
    let (provenance, about, features) = (provenance(inputs, plan), about(inputs, plan), columns(&inputs[0], plan));
    let form = Form { about, features, provenance: &provenance, interrupt, sizes: Sizes::USUAL };
    let split = parts.iter().any(|part| !part.folder.is_empty());
    let ours =
        move |path: &Path| if split { crate::data::dataset::is_file(path) } else { crate::data::dataset::is_root_file(path) };
    atomic::write_dir(out, ours, |dir| {
        let dirs: Vec<PathBuf> = parts.iter().map(|part| dir.join(part.folder)).collect();
        let mut fillings = dirs.iter().map(|dir| Filling::new(&form, dir)).collect::<Result<Vec<_>>>()?;
        for (at, input) in inputs.iter().enumerate() {
            let wanted: Vec<_> = form.features.iter().filter(|f| input.root.info.feature(&f.name).is_some()).collect();
            let columns: Vec<_> = wanted.iter().map(|f| (&*f.name, f.kind, f.width)).collect();
            foreign::each(&input.root, &columns, &mut |frames| {
                interrupt.check()?;
                for (part, filling) in parts.iter().zip(&mut fillings) {
                    if part.takes[at][frames.number] {
                        let episode = numbered(input, &form, &wanted, &frames, filling.next(), plan)?;
                        filling.push(episode)?;
                    }
                }
                Ok(())
            })?;
        }
        fillings.into_iter().try_for_each(Filling::finish)
    })
}

/// All inputs have the same columns, of entries that are called alike, and none that cannot be written.
fn check(inputs: &[Input], plan: &Plan) -> Result<()> {
    let first = &inputs[0];
    for input in inputs {
        let refuse = |why: String| Err(Error::input(&input.root.path, why));
        let unwritable: Vec<(&str, &str)> =
            input.unwritable().filter(|(name, _)| !plan.dropped.iter().any(|d| d == name)).collect();
        if !unwritable.is_empty() {
            let words: Vec<String> = unwritable.iter().map(|(name, dtype)| format!("{name} ({dtype})")).collect();
            let names: Vec<&str> = unwritable.iter().map(|(name, _)| *name).collect();
            return refuse(format!(
                "has columns that hilt cannot write: {}; leave them out: hilt dataset drop --columns {}",
                words.join(", "),
                names.join(",")
            ));
        }
        if input.root.info.fps != first.root.info.fps {
            let (ours, theirs) = (first.root.info.fps, input.root.info.fps);
            return refuse(format!("has {theirs} frames per second, {} has {ours}", first.root.path.display()));
        }
        let of = |input: &Input| -> Vec<(String, Kind, usize)> {
            let mut all: Vec<_> = columns(input, plan).iter().map(|f| (f.name.to_string(), f.kind, f.width)).collect();
            all.sort_by(|a, b| a.0.cmp(&b.0));
            all
        };
        let (ours, theirs) = (of(first), of(input));
        if let Some(odd) = ours.iter().find(|c| !theirs.contains(c)).or_else(|| theirs.iter().find(|c| !ours.contains(c))) {
            let (name, kind, width) = (&odd.0, odd.1.dtype(), odd.2);
            return refuse(format!(
                "and {} do not both have a column {name} of {width} {kind}; drop it from the one (hilt dataset drop --columns {name}) or \
                 convert both (hilt dataset convert)",
                first.root.path.display()
            ));
        }
        let same = match (&input.own, &first.own) {
            (Some((layout, made)), Some((other, first_made))) => {
                layout == other && ["task", "robot"].iter().all(|key| made.settings[key] == first_made.settings[key])
            }
            (ours, theirs) => ours.is_none() == theirs.is_none(),
        };
        if !same {
            return refuse(format!("and {} are not of the same task and robot", first.root.path.display()));
        }
        let called = |input: &Input, name: &str| input.features.iter().find(|f| *f.name == *name).and_then(|f| f.names.clone());
        for (name, ..) in &ours {
            if let (Some(ours), Some(theirs)) = (called(first, name), called(input, name))
                && let Some(at) = (0..ours.len()).find(|at| ours[*at] != theirs[*at])
            {
                let (path, ours, theirs) = (first.root.path.display(), shown(&ours[at]), shown(&theirs[at]));
                return refuse(format!(
                    "calls entry {at} of column {name} \"{theirs}\", {path} calls it \"{ours}\"; bring them into one order, or where they are the \
                     same correct the names in meta/info.json"
                ));
            }
        }
        if let (Some(ours), Some(theirs)) = (&first.root.info.robot_type, &input.root.info.robot_type)
            && ours != theirs
        {
            let (path, ours, theirs) = (first.root.path.display(), shown(ours), shown(theirs));
            return refuse(format!(
                "is of a robot \"{theirs}\", {path} of \"{ours}\"; where they are the same correct robot_type in meta/info.json"
            ));
        }
    }
    Ok(())
}

/// The columns that are written.
fn columns(input: &Input, plan: &Plan) -> Vec<Feature> {
    let kept = input.features.iter().filter(|f| !plan.dropped.iter().any(|name| **name == *f.name));
    let narrowed =
        |f: &Feature| Feature { kind: if plan.normalise && f.kind == Kind::F64 { Kind::F32 } else { f.kind }, ..f.clone() };
    kept.map(narrowed).collect()
}

fn provenance(inputs: &[Input], plan: &Plan) -> Provenance {
    let first = &inputs[0];
    // What demos of hilt are checked by stays.
    let mut settings = first.stays_own(&plan.dropped).map_or_else(|| json!({}), |(_, made)| made.settings.clone());
    settings[STAGE] = plan.said.clone();
    let made = Provenance::new(STAGE, &first.name(), settings, plan.seed);
    inputs.iter().enumerate().fold(made, |made, (at, input)| {
        let role = if inputs.len() == 1 { "dataset".to_string() } else { format!("dataset {at}") };
        made.with_input(&role, &input.content)
    })
}

fn about(inputs: &[Input], plan: &Plan) -> About {
    let (first, mut tasks) = (&inputs[0], Vec::<String>::new());
    for text in inputs.iter().flat_map(Input::tasks) {
        if !tasks.contains(&text) {
            tasks.push(text);
        }
    }
    About {
        robot_type: first.root.info.robot_type.clone(),
        fps: first.root.info.fps,
        tasks,
        layout: first.stays_own(&plan.dropped).map(|(layout, _)| layout.clone()),
    }
}

/// An episode with its numbers in the new dataset.
fn numbered(
    input: &Input,
    form: &Form,
    wanted: &[&Feature],
    frames: &Frames,
    (number, first): (usize, usize),
    plan: &Plan,
) -> Result<Episode> {
    let n = frames.length;
    let given = |name: &str| wanted.iter().position(|f| *f.name == *name).map(|at| &frames.cells[at]);
    let mut tasks = input.root.episodes[frames.number].tasks.clone();
    if tasks.is_empty() {
        tasks.extend(input.tasks().into_iter().next());
    }
    let fill = |feature: &Feature| -> Result<Cells> {
        Ok(match (&*feature.name, given(&feature.name)) {
            (EPISODE, _) => Cells::I64(vec![number as i64; n]),
            (INDEX, _) => Cells::I64((first..first + n).map(|i| i as i64).collect()),
            (TASK, found) => Cells::I64(task_numbers(input, form, found, frames, &tasks)?),
            (TIMESTAMP, found) if found.is_none() || plan.normalise => {
                Cells::F32((0..n).map(|t| timestamp_at(t, form.about.fps)).collect())
            }
            (_, Some(found)) => found.clone(),
            // Of the columns that every dataset has, frame_index alone is left.
            (_, None) => Cells::I64((0..n as i64).collect()),
        })
    };
    let cells = form.features.iter().map(fill).collect::<Result<Vec<_>>>()?;
    Ok(Episode { cells, tasks })
}

/// The new numbers of the tasks of an episode's frames: the first of the episode where they have none that says anything.
fn task_numbers(input: &Input, form: &Form, found: Option<&Cells>, frames: &Frames, tasks: &[String]) -> Result<Vec<i64>> {
    let at = |text: &String| form.about.tasks.iter().position(|task| task == text).map(|at| at as i64);
    let Some(Cells::I64(old)) = found.filter(|_| !input.instructions.is_empty()) else {
        let number = tasks.first().and_then(at).or_else(|| input.tasks().first().and_then(at));
        return Ok(vec![number.unwrap_or(0); frames.length]);
    };
    let new = |old: &i64| {
        let text = usize::try_from(*old).ok().and_then(|old| input.instructions.get(old));
        text.and_then(at).ok_or_else(|| {
            let message = format!("episode {} has {TASK} {old}, which is not in meta/tasks.parquet", frames.number);
            Error::input(&input.root.path, message)
        })
    };
    old.iter().map(new).collect()
}
