//! Where an artefact came from. The same inputs give the same words: no times, no machine, no absolute paths.

use super::content_hash::ContentHash;
use super::json_text;
use super::seal::{self, SCHEMA_VERSION};
use crate::error::{Error, Result};
use crate::words::shown;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// The metadata key of every format that holds the provenance.
pub const KEY: &str = "hilt";

/// Most characters of a task's name.
const LONGEST_NAME: usize = 64;

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
    /// The task's name.
    #[serde(deserialize_with = "task_name")]
    pub task: String,
    /// The stage's settings after defaults, file and flags.
    pub settings: serde_json::Value,
    /// The run's seed.
    pub seed: u64,
    /// Content hashes of the files the stage read, by a name that is the same everywhere ("plans.parquet").
    pub inputs: BTreeMap<String, String>,
}

impl Provenance {
    /// Of this version of hilt, without inputs.
    pub fn new(stage: &str, task: &str, settings: serde_json::Value, seed: u64) -> Self {
        Provenance {
            hilt_version: env!("CARGO_PKG_VERSION").into(),
            schema_version: SCHEMA_VERSION,
            stage: stage.into(),
            task: task.into(),
            settings,
            seed,
            inputs: BTreeMap::new(),
        }
    }

    /// Adds a file or directory that the stage has read, under a name that is the same everywhere ("dataset").
    pub fn with_input(mut self, name: &str, content: &ContentHash) -> Self {
        self.inputs.insert(name.into(), content.to_string());
        self
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
        let value =
            json_text::parse(json.as_bytes()).map_err(|e| Error::input(path, format!("its provenance is no JSON: {e}")))?;
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

/// What can be the name of a task, also of one that is not there any more.
fn task_name<'de, D: Deserializer<'de>>(deserializer: D) -> std::result::Result<String, D::Error> {
    let name = String::deserialize(deserializer)?;
    let letters = name.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b"-_".contains(&b));
    if letters && (1..=LONGEST_NAME).contains(&name.len()) {
        return Ok(name);
    }
    let name = shown(&name);
    Err(D::Error::custom(format!("{name:?} is no name of a task: 1 to {LONGEST_NAME} small letters, digits, - and _")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_task_may_have_any_name_that_is_one() {
        let of = |task: &str| Provenance::new("plan", task, json!({}), 0);
        let read = |task: &str| Provenance::from_json(Path::new("plans.parquet"), &of(task).to_json());
        for name in ["pick-up", "my_task-2", &"t".repeat(64)] {
            assert_eq!(read(name).expect("a provenance"), of(name));
        }
        for name in ["", "Pick-up", "../stack", "two words", "\u{e4}", "a\nb", &"t".repeat(65)] {
            let said = read(name).expect_err("refused").to_string();
            assert!(said.contains("its provenance cannot be read: ") && said.contains("is no name of a task"), "{said}");
        }
    }
}
