//! How the artefact of one stage stands.

use super::artefacts::Artefact;
use super::stamp::Stamp;
use crate::config::Stage;
use crate::data::origin::bytes_of;
use crate::data::{ContentHash, Provenance};
use serde::Serialize;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// What there is to say of an artefact.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Condition {
    /// Whole, and made from what stands there.
    Whole,
    /// Whole, but something before it is another now.
    Stale,
    /// Its own reader refuses it.
    Damaged,
    /// It was begun.
    Unfinished,
    /// It is not there.
    Missing,
}

impl Condition {
    /// The word in tables.
    pub fn name(&self) -> &'static str {
        match self {
            Condition::Whole => "whole",
            Condition::Stale => "stale",
            Condition::Damaged => "damaged",
            Condition::Unfinished => "unfinished",
            Condition::Missing => "missing",
        }
    }
}

/// A stage of a run.
#[derive(Clone, Debug)]
pub struct Standing {
    /// The stage.
    pub stage: Stage,
    /// The stage as make calls it (`train-bc`), or its file's name where make has no name for it.
    pub name: String,
    /// Where its artefact is, or would be.
    pub path: PathBuf,
    /// How it stands.
    pub condition: Condition,
    /// Why it is not whole, or what else there is to know.
    pub why: Option<String>,
    /// Its bytes, those of all files where it is a directory.
    pub bytes: u64,
    /// By its log \[s\].
    pub wall_s: Option<f64>,
    /// By its log \[s\].
    pub processor_s: Option<f64>,
    /// What it says of its origin, and the hash that the next stage calls it by.
    pub origin: Option<(Provenance, ContentHash)>,
}

/// The name of an input in provenances, and the stage that makes it.
const ROLES: [(&str, Stage); 5] = [
    ("plans", Stage::Plan),
    ("recordings", Stage::Simulate),
    ("dataset", Stage::Convert),
    ("dynamics", Stage::Pretrain),
    ("policy", Stage::Train),
];

/// The stage whose artefact goes by this name among inputs.
pub(super) fn stage_of(role: &str) -> Option<Stage> {
    ROLES.iter().find(|(name, _)| *name == role).map(|(_, stage)| *stage)
}

impl Standing {
    /// Of an artefact that is there, its origin as its own reader tells it.
    pub(super) fn of(artefact: &Artefact, name: String, origin: Result<(Provenance, ContentHash), String>) -> Self {
        let (condition, why, origin) = match origin {
            Ok(origin) => (Condition::Whole, None, Some(origin)),
            Err(why) => (Condition::Damaged, Some(why), None),
        };
        let (stage, path) = (artefact.stage, artefact.path.clone());
        Standing { stage, name, bytes: bytes_of(&path), path, condition, why, wall_s: None, processor_s: None, origin }
    }

    /// Finds out whether what it was made from is what stands there, and whether make would run it again.
    pub(super) fn judge(&mut self, dir: &Path, before: &[&Standing]) {
        if self.condition != Condition::Whole {
            return;
        }
        if let Some(why) = self.of_others(before).or_else(|| self.by_stamp(dir, before)) {
            (self.condition, self.why) = (Condition::Stale, Some(why));
        }
    }

    /// By hashes: its inputs are no longer those that stand there, or are stale.
    fn of_others(&self, before: &[&Standing]) -> Option<String> {
        let (made, _) = self.origin.as_ref()?;
        for (role, hash) in &made.inputs {
            let stage = stage_of(role)?;
            let there: Vec<&&Standing> = before.iter().filter(|other| other.stage == stage && other.origin.is_some()).collect();
            let same = there.iter().find(|other| other.origin.as_ref().is_some_and(|(_, content)| content.to_string() == *hash));
            match (same, there.first()) {
                (Some(same), _) if same.condition == Condition::Stale => {
                    return Some(format!("it follows {}, which is stale", same.name));
                }
                (None, Some(other)) => return Some(format!("it was made from another {}", file_name(&other.path))),
                _ => {}
            }
        }
        None
    }

    /// By what make has noted. What it would keep has a note.
    fn by_stamp(&mut self, dir: &Path, before: &[&Standing]) -> Option<String> {
        let stamp = Stamp::read(dir, &self.name)?;
        let (made, _) = self.origin.as_ref()?;
        let last = made.inputs.iter().max_by_key(|(role, _)| stage_of(role).map(|stage| stage as usize));
        let is_last = |other: &&&Standing| {
            let content = other.origin.as_ref().map(|(_, content)| content.to_string());
            last.is_some_and(|(role, hash)| stage_of(role) == Some(other.stage) && content.as_ref() == Some(hash))
        };
        let files = before.iter().find(is_last).and_then(|other| Stamp::read(dir, &other.name));
        let files = files.map(|stamp| stamp.files()).unwrap_or_default();
        let why = stamp.stale(&files).map(String::from);
        if why.is_none() && !stamp.as_left() {
            self.why = Some("it is not the one that make left there".into());
        }
        why
    }

    /// For machines.
    pub(super) fn to_json(&self) -> Value {
        json!({
            "stage": self.stage.name(),
            "name": self.name,
            "path": self.path.display().to_string(),
            "condition": self.condition,
            "why": self.why,
            "bytes": self.bytes,
            "wall_s": self.wall_s,
            "processor_s": self.processor_s,
            "content": self.origin.as_ref().map(|(_, content)| content.to_string()),
            "provenance": self.origin.as_ref().map(|(made, _)| made),
        })
    }
}

/// The last part of a path, for people.
pub(super) fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
