//! Where an artefact came from. The same inputs give the same words: no times, no machine, no absolute paths.

use super::seal;
use crate::error::{Error, Result};
use crate::interrupt;
use crate::tasks::Task;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Version of the layout of all artefacts. It grows when a reader of the old layout would fail.
pub const SCHEMA_VERSION: u32 = 1;
/// The metadata key of every format that holds the provenance.
pub const KEY: &str = "hilt";

/// What made an artefact, out of what.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// Version of hilt.
    pub hilt_version: String,
    /// Version of the file layout, [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// The stage: "plan", "simulate", ...
    pub stage: String,
    /// The task.
    pub task: Task,
    /// The stage's settings after defaults, file and flags.
    pub settings: serde_json::Value,
    /// The run's seed.
    pub seed: u64,
    /// Content hashes of the files the stage read, by a name that is the same everywhere ("plans.parquet").
    pub inputs: BTreeMap<String, String>,
}

impl Provenance {
    /// Of this version of hilt, without inputs.
    pub fn new(stage: &str, task: Task, settings: serde_json::Value, seed: u64) -> Self {
        Provenance {
            hilt_version: env!("CARGO_PKG_VERSION").into(),
            schema_version: SCHEMA_VERSION,
            stage: stage.into(),
            task,
            settings,
            seed,
            inputs: BTreeMap::new(),
        }
    }

    /// Adds a file or directory that the stage reads, under a name that is the same everywhere ("dataset/train").
    ///
    /// # Errors
    /// See [`hash_path`].
    pub fn with_input(mut self, name: &str, path: &Path) -> Result<Self> {
        self.inputs.insert(name.into(), hash_path(path)?);
        Ok(self)
    }

    /// One line of JSON, keys sorted within the settings.
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).expect("a provenance has string keys only")
    }

    /// The inverse of [`Provenance::to_json`]; `path` is the file it was found in.
    ///
    /// # Errors
    /// [`Error::Input`] for another schema version and for JSON that is no provenance.
    pub fn from_json(path: &Path, json: &str) -> Result<Self> {
        let value = serde_json::from_str(json).map_err(|e| Error::input(path, format!("its provenance is no JSON: {e}")))?;
        Provenance::from_value(path, value)
    }

    /// As [`Provenance::from_json`], of a parsed value.
    ///
    /// # Errors
    /// [`Error::Input`] for another schema version and for a value that is no provenance.
    pub fn from_value(path: &Path, value: serde_json::Value) -> Result<Self> {
        match value.get("schema_version").and_then(serde_json::Value::as_u64) {
            Some(version) if version != u64::from(SCHEMA_VERSION) => Err(seal::wrong_version(path, version)),
            _ => serde_json::from_value(value).map_err(|e| Error::input(path, format!("its provenance cannot be read: {e}"))),
        }
    }
}

/// Content hash (BLAKE3, hexadecimal) of a file, or of a directory: names relative to it, sorted, each with its content. The
/// place and the times of the files do not matter.
///
/// # Errors
/// [`Error::Io`] when something cannot be read.
pub fn hash_path(path: &Path) -> Result<String> {
    if !path.is_dir() {
        return hash_file(path).map(|h| h.to_hex().to_string());
    }
    let mut hash = blake3::Hasher::new();
    for name in files_under(path)? {
        let shown = name.to_string_lossy();
        hash.update(&(shown.len() as u64).to_le_bytes()).update(shown.as_bytes());
        hash.update(hash_file(&path.join(&name))?.as_bytes());
    }
    Ok(hash.finalize().to_hex().to_string())
}

fn hash_file(path: &Path) -> Result<blake3::Hash> {
    let _waits = interrupt::waiting();
    let file = fs::File::open(path).map_err(|e| Error::io(path, "read", e))?;
    let mut hash = blake3::Hasher::new();
    hash.update_reader(file).map_err(|e| Error::io(path, "read", e))?;
    Ok(hash.finalize())
}

/// Paths of all files below `root`, relative to it, sorted.
pub(super) fn files_under(root: &Path) -> Result<Vec<PathBuf>> {
    let _waits = interrupt::waiting();
    let (mut found, mut open) = (Vec::new(), vec![PathBuf::new()]);
    while let Some(inner) = open.pop() {
        let dir = root.join(&inner);
        for entry in fs::read_dir(&dir).map_err(|e| Error::io(&dir, "read", e))? {
            let name = inner.join(entry.map_err(|e| Error::io(&dir, "read", e))?.file_name());
            if root.join(&name).is_dir() { open.push(name) } else { found.push(name) }
        }
    }
    found.sort();
    Ok(found)
}
