//! What must hold of a dataset before anything learns from it: `meta/info.json` against the task, numbers against each other.

use super::features::{Feature, features};
use super::meta::{CODEBASE_VERSION, INFO, LAYOUT};
use crate::data::bytes::Format;
use crate::data::{ContentHash, Provenance, json_file, json_text, provenance, seal};
use crate::error::{Error, Result};
use crate::layout::Layout;
use crate::robot::file::built_in::paper_robot;
use crate::state::CONTROL_HZ;
use crate::task::built_in;
use serde::Deserialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// The JSON files of a dataset from outside.
pub(super) const DESCRIPTION: Format = Format {
    most_bytes: 64 << 20,
    reason: "a description has some 30 kB, and a line for each of its files",
    head: |_, _| Ok(()),
    ends: |_, _| Ok(()),
};

/// `meta/info.json`, as far as hilt reads it.
pub(super) struct Info {
    /// The task's name.
    pub(super) task: String,
    pub(super) layout: Arc<Layout>,
    pub(super) fps: u32,
    pub(super) episodes: usize,
    pub(super) frames: usize,
    pub(super) provenance: Provenance,
    /// Content hashes by path below the root.
    pub(super) files: BTreeMap<String, String>,
    /// Of the description itself.
    pub(super) hash: ContentHash,
}

#[derive(Deserialize)]
struct Counts {
    fps: u32,
    total_episodes: usize,
    total_frames: usize,
}

/// Reads and checks `meta/info.json`.
pub(super) fn info(root: &Path) -> Result<Info> {
    let path = root.join(INFO);
    if !path.is_file() {
        return Err(Error::input(root, no_dataset(root)));
    }
    let bytes = DESCRIPTION.read(&path)?;
    let invalid = |e: serde_json::Error| Error::input(&path, format!("cannot be read: {e}"));
    let mut value: Value = json_text::parse(&bytes).map_err(|why| Error::input(&path, format!("cannot be read: {why}")))?;
    let version = value.get("codebase_version").and_then(Value::as_str).unwrap_or("none");
    if version != CODEBASE_VERSION {
        let message = format!("has codebase_version \"{version}\", hilt reads \"{CODEBASE_VERSION}\"; run hilt convert again");
        return Err(Error::input(&path, message));
    }
    let counts: Counts = serde_json::from_value(value.clone()).map_err(invalid)?;
    let found = json_file::provenance_of(&path, value.get(provenance::KEY).cloned())?;
    let layout = layout(&path, &found.task, &value)?;
    check_features(&path, &layout, value.get("features"))?;
    if counts.fps != CONTROL_HZ {
        return Err(Error::input(&path, format!("has {} frames per second, hilt works at {CONTROL_HZ}", counts.fps)));
    }
    seal::check(&path, &bytes)?;
    let files = value.get_mut(provenance::KEY).and_then(|h| h.get_mut("files")).map(Value::take).unwrap_or_default();
    let files: BTreeMap<String, String> = serde_json::from_value(files).map_err(invalid)?;
    let Counts { fps, total_episodes: episodes, total_frames: frames } = counts;
    let hash = ContentHash::of(&bytes);
    Ok(Info { task: found.task.clone(), layout, fps, episodes, frames, provenance: found, files, hash })
}

fn no_dataset(root: &Path) -> String {
    if !root.exists() {
        return "does not exist; hilt convert makes datasets".into();
    }
    let inner = |name: &str| root.join(name).join(INFO).is_file();
    if inner(super::meta::TRAIN) || inner(super::meta::VALIDATION) {
        return format!("holds the two datasets {} and {}; name one of them", super::meta::TRAIN, super::meta::VALIDATION);
    }
    format!("is no dataset: {INFO} is missing")
}

/// What its rows hold; a dataset that does not say is of the paper's robot, when there was no other.
fn layout(path: &Path, task: &str, value: &Value) -> Result<Arc<Layout>> {
    let Some(said) = value.get(provenance::KEY).and_then(|hilt| hilt.get(LAYOUT)) else {
        let known = built_in::find(task).map_err(|why| Error::input(path, format!("does not say its layout: {why}")))?;
        return Ok(known.layout(&paper_robot()));
    };
    let layout: Layout =
        serde_json::from_value(said.clone()).map_err(|e| Error::input(path, format!("its layout cannot be read: {e}")))?;
    if layout.name != task {
        return Err(Error::input(path, format!("its layout is of {}, its provenance of {task}", layout.name)));
    }
    layout.check().map_err(|why| Error::input(path, format!("its layout cannot be: {why}")))?;
    Ok(Arc::new(layout))
}

/// The declared features against those of the layout.
fn check_features(path: &Path, layout: &Layout, declared: Option<&Value>) -> Result<()> {
    let task = &layout.name;
    for Feature { name, kind, width, .. } in features(layout) {
        let entry = declared.and_then(|d| d.get(&*name));
        let entry = entry.ok_or_else(|| Error::input(path, format!("does not declare the feature {name} that {task} has")))?;
        let shape: Vec<usize> = entry.get("shape").and_then(|s| serde_json::from_value(s.clone()).ok()).unwrap_or_default();
        let dtype = entry.get("dtype").and_then(Value::as_str).unwrap_or("none");
        if shape != [width] || dtype != kind.dtype() {
            let message = format!("declares {name} as {dtype} {shape:?}, {task} has {} [{width}]", kind.dtype());
            return Err(Error::input(path, message));
        }
    }
    Ok(())
}

/// Refuses a number that is not finite, by column and row.
pub(super) fn finite(path: &Path, name: &str, width: usize, first_row: usize, values: &[f32]) -> Result<()> {
    match values.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(at) => {
            let row = first_row + at / width;
            let message = format!("column {name}, row {row}, entry {}: {} is not a finite number", at % width, values[at]);
            Err(Error::input(path, message))
        }
    }
}
