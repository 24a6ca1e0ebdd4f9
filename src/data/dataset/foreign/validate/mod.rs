//! Everything that is wrong with a dataset, not only the first of it: what LeRobot needs to load it, and what learning needs beyond.

mod problems;
mod rows;

use super::description::Info;
use super::{Root, instructions, is_foreign};
use crate::data::dataset::features::{EPISODE, FRAME, INDEX, TASK, TIMESTAMP};
use crate::data::dataset::meta::{STATS, TASKS};
use crate::data::dataset::{check::DESCRIPTION, read};
use crate::data::json_text;
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use problems::Problems;
use rows::Scan;
use serde_json::Value;
use std::path::Path;

/// The columns that LeRobot takes for granted, with their types.
const DEFAULTS: [(&str, &[&str]); 5] =
    [(TIMESTAMP, &["float32", "float64"]), (FRAME, &["int64"]), (EPISODE, &["int64"]), (INDEX, &["int64"]), (TASK, &["int64"])];
/// Statistics that LeRobot normalises with.
const STATISTICS: [&str; 4] = ["min", "max", "mean", "std"];

/// All problems of the dataset at `root`, in words; none for a sound one.
///
/// # Errors
/// [`crate::error::Error::Interrupted`]; what cannot be read at all is a problem.
pub fn problems(root: &Path, interrupt: &Interrupt) -> Result<Vec<String>> {
    let mut found = Problems::default();
    let info = match Info::read(root) {
        Ok(info) => info,
        Err(why) => {
            found.take(root, Err(why));
            return Ok(found.said);
        }
    };
    if !is_foreign(root) {
        // Its seal and its own rules.
        let read = read::each(root, |_| interrupt.check());
        if matches!(read, Err(Error::Interrupted)) {
            return Err(Error::Interrupted);
        }
        found.take(root, read.map(drop));
    }
    described(&info, &mut found);
    let opened = Root::open(root);
    let instructions = instructions(root);
    let tasks = instructions.as_ref().map_or(0, Vec::len);
    if !root.join(TASKS).is_file() {
        found.say(format!("{TASKS} is missing: LeRobot does not load the dataset without it"));
    }
    found.take(root, instructions.map(drop));
    statistics(root, &info, &mut found);
    match opened {
        Ok(opened) => Scan::new(&opened, tasks, &mut found).all(interrupt)?,
        Err(why) => found.take(root, Err(why)),
    }
    found.said.dedup();
    Ok(found.said)
}

fn described(info: &Info, found: &mut Problems) {
    for (name, types) in DEFAULTS {
        match info.feature(name) {
            None => found.say(format!("meta/info.json declares no column {name}, which every dataset has")),
            Some(column) if column.shape != [1] || !types.contains(&column.dtype.as_str()) => {
                let (dtype, shape) = (&column.dtype, &column.shape);
                found.say(format!("meta/info.json declares {name} as {dtype} {shape:?}; expected {} [1]", types[0]));
            }
            Some(_) => {}
        }
    }
    for column in &info.features {
        if column.name.contains('/') {
            found.say(format!("column {} has a / in its name, which LeRobot refuses; use dots", column.name));
        }
    }
    if info.fps.fract() != 0.0 {
        found.say(format!("meta/info.json has {} frames per second; LeRobot's fps is a whole number", info.fps));
    }
}

fn statistics(root: &Path, info: &Info, found: &mut Problems) {
    let path = root.join(STATS);
    if !path.is_file() {
        found.say(format!("{STATS} is missing: LeRobot normalises with it (hilt dataset convert writes it anew)"));
        return;
    }
    let bytes = match DESCRIPTION.read(&path) {
        Ok(bytes) => bytes,
        Err(why) => return found.take(root, Err(why)),
    };
    // Python writes NaN and Infinity, which JSON has not.
    let Ok(value) = json_text::parse::<Value>(&bytes) else {
        return found.say(format!("{STATS} is no JSON, or holds NaN or Infinity"));
    };
    for column in info.features.iter().filter(|column| column.is_numeric()) {
        for name in STATISTICS {
            let numbers = value.get(&column.name).and_then(|of| of.get(name));
            let mut flat = Vec::new();
            numbers.into_iter().for_each(|numbers| flatten(numbers, &mut flat));
            if flat.len() != column.width() {
                let (n, width) = (flat.len(), column.width());
                found.say(format!("{STATS} has {n} numbers for {name} of {}, the column has {width} entries", column.name));
            }
        }
    }
}

fn flatten(value: &Value, found: &mut Vec<f64>) {
    match value {
        Value::Array(items) => items.iter().for_each(|item| flatten(item, found)),
        other => found.extend(other.as_f64()),
    }
}
