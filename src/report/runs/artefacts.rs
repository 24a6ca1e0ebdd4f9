//! What of a run stands in a directory, told by a glance at each file.

use crate::config::Stage;
use crate::data::origin::Kind;
use crate::data::peek::{Format, peek};
use crate::data::{dataset, recording, weights};
use crate::error::{Error, Result};
use crate::interrupt;
use std::fs;
use std::path::{Path, PathBuf};

/// What a stage has left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Artefact {
    /// The stage.
    pub stage: Stage,
    /// The file or directory.
    pub path: PathBuf,
    /// What it is.
    pub kind: Kind,
}

/// Names of the directories that `hilt simulate` and `hilt convert` fill.
const RECORDINGS: &str = "recordings";
const DATASET: &str = "dataset";

/// The artefacts right below `dir`, in the order of the stages, then by name. Hidden files and those of other programs are none, and no tables
/// that stand beside an artefact.
///
/// # Errors
/// [`Error::Io`] when the directory cannot be read.
pub fn artefacts(dir: &Path) -> Result<Vec<Artefact>> {
    let _waits = interrupt::waiting();
    let entries = fs::read_dir(dir).map_err(|e| Error::io(dir, "read", e))?;
    let paths = entries.map(|entry| entry.map(|e| e.path())).collect::<std::io::Result<Vec<_>>>();
    let mut found: Vec<Artefact> = paths.map_err(|e| Error::io(dir, "read", e))?.into_iter().filter_map(artefact).collect();
    // policy.safetensors before policy-bc.safetensors.
    let place = |artefact: &Artefact| (artefact.stage as usize, artefact.path.file_stem().map(|stem| stem.to_os_string()));
    found.sort_by_key(place);
    Ok(found)
}

/// Whether a directory holds an artefact of a run, and is none itself.
pub fn is_run(dir: &Path) -> bool {
    let is_artefact = dir.join("meta").is_dir() || dir.join(dataset::TRAIN).is_dir() || dir.join(dataset::VALIDATION).is_dir();
    !is_artefact
        && recording::files(dir).is_ok_and(|files| files.is_empty())
        && artefacts(dir).is_ok_and(|found| !found.is_empty())
}

fn artefact(path: PathBuf) -> Option<Artefact> {
    let name = path.file_name()?.to_str()?.to_string();
    let of = |stage, kind| Some(Artefact { stage, path: path.clone(), kind });
    if path.is_dir() {
        return match name.as_str() {
            RECORDINGS if !recording::files(&path).ok()?.is_empty() => of(Stage::Simulate, Kind::Recordings),
            DATASET if path.join(dataset::TRAIN).is_dir() => of(Stage::Convert, Kind::Datasets),
            _ => None,
        };
    }
    let ending = Path::new(&name).extension()?.to_str()?;
    if name.starts_with('.') || !["parquet", "safetensors", "json"].contains(&ending) {
        return None;
    }
    let found = peek(&path).ok()?;
    match (found.format, found.stage.as_deref()?, found.kind.as_deref()) {
        (Format::Parquet, "plan", _) => of(Stage::Plan, Kind::Table),
        (Format::Safetensors, _, Some(weights::DYNAMICS)) => of(Stage::Pretrain, Kind::Weights(weights::DYNAMICS)),
        (Format::Safetensors, _, Some(weights::POLICY)) => of(Stage::Train, Kind::Weights(weights::POLICY)),
        (Format::Json, "evaluate", _) => of(Stage::Evaluate, Kind::Summary),
        _ => None,
    }
}
