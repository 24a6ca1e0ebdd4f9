//! The checkpoint of training as a file beside its result.

use super::Console;
use super::differences::differences;
use crate::data::{Provenance, weights};
use crate::error::{Error, Result};
use crate::learn::Checkpoint;
use std::fs;
use std::path::Path;

/// What a checkpoint's name has in place of the ending of the weights that it is for.
pub const ENDING: &str = "checkpoint.safetensors";
/// Parts of a provenance, in the order in which two are compared.
const PARTS: [&str; 7] = ["hilt_version", "schema_version", "stage", "task", "seed", "settings", "inputs"];

/// Reads the checkpoint at `path`; `None` when there is none.
///
/// # Errors
/// [`Error::Input`] when the file is damaged or foreign, or when another run made it: the first difference to `ours` is named.
pub fn read(path: &Path, ours: &Provenance) -> Result<Option<Checkpoint>> {
    if !path.exists() {
        return Ok(None);
    }
    let anew = "without --resume training starts from the beginning and replaces the file";
    let (tensors, meta, theirs) = weights::read(path, weights::CHECKPOINT).map_err(|e| match e {
        Error::Input { path, message } => Error::Input { path, message: format!("{message}; {anew}") },
        other => other,
    })?;
    match first_difference(&theirs, ours) {
        None => Ok(Some(Checkpoint { tensors, meta })),
        Some((key, theirs, ours)) => Err(Error::input(
            path,
            format!(
                "is the checkpoint of another run: {key} was {theirs}, now it is {ours}; go on with the old one, or give another --out; {anew}"
            ),
        )),
    }
}

/// The first key in which two provenances differ, and both values.
fn first_difference(theirs: &Provenance, ours: &Provenance) -> Option<(String, String, String)> {
    let value = |provenance: &Provenance| serde_json::to_value(provenance).expect("a provenance has string keys only");
    let (theirs, ours) = (value(theirs), value(ours));
    let found = PARTS.iter().find_map(|part| {
        let name = if *part == "settings" { "" } else { part };
        differences(name, &theirs[*part], &ours[*part]).into_iter().next()
    });
    found.map(|found| (found.key, found.theirs.to_string(), found.ours.to_string()))
}

/// Keeps the checkpoint of one run.
pub struct Keeper<'a> {
    path: &'a Path,
    provenance: &'a Provenance,
    console: &'a Console,
    /// Where training stood in this run's checkpoint on the disk, in words.
    kept: Option<String>,
}

impl<'a> Keeper<'a> {
    /// Of a run that begins, or goes on after what `resumed` says.
    pub fn new(path: &'a Path, provenance: &'a Provenance, console: &'a Console, resumed: Option<&Checkpoint>) -> Self {
        Keeper { path, provenance, console, kept: resumed.map(|checkpoint| checkpoint.after().to_string()) }
    }

    /// Puts a checkpoint in place of the one before. A disk that refuses does not stop training.
    pub fn keep(&mut self, checkpoint: &Checkpoint) {
        match weights::write(self.path, weights::CHECKPOINT, &checkpoint.tensors, &checkpoint.meta, self.provenance) {
            Ok(()) => self.kept = Some(checkpoint.after().to_string()),
            Err(why) => self.console.say(&format!("train: the state after {} was not kept: {why}", checkpoint.after())),
        }
    }

    /// The error that ended training, with the place of what was kept.
    pub fn explain(&self, error: Error) -> Error {
        let path = self.path.display();
        match (error, &self.kept) {
            (Error::Interrupted, Some(after)) => Error::InterruptedAt(format!(
                "the state after {after} is in {path}: run the same command with --resume to continue"
            )),
            (Error::Failed(why), Some(after)) => {
                Error::Failed(format!("{why}; the last good state, after {after}, is kept in {path}"))
            }
            (other, _) => other,
        }
    }

    /// Removes the checkpoint once the results are in place.
    ///
    /// # Errors
    /// [`Error::Io`] when the system refuses.
    pub fn remove(self) -> Result<()> {
        match fs::remove_file(self.path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Error::io(self.path, "remove", e)),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tasks::Task;
    use serde_json::json;

    #[test]
    fn the_first_difference_has_its_key_and_both_values() {
        let one = Provenance::new("train", Task::Stack, json!({"method": "hil", "train": {"rho": 0.3, "tau": 0.5}}), 1);
        let difference = |change: fn(&mut Provenance)| {
            let mut other = one.clone();
            change(&mut other);
            first_difference(&one, &other)
        };
        let found = |key: &str, theirs: &str, ours: &str| Some((key.to_string(), theirs.to_string(), ours.to_string()));
        assert_eq!(difference(|_| {}), None);
        assert_eq!(difference(|p| p.seed = 2), found("seed", "1", "2"));
        assert_eq!(difference(|p| p.settings["train"]["rho"] = 0.4.into()), found("train.rho", "0.3", "0.4"));
        assert_eq!(difference(|p| p.settings["method"] = "bc".into()), found("method", "\"hil\"", "\"bc\""));
        let with_input = |p: &mut Provenance| drop(p.inputs.insert("dataset".into(), "ab".into()));
        assert_eq!(difference(with_input), found("inputs.dataset", "\"missing\"", "\"ab\""));
    }
}
