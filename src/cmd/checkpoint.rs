//! The checkpoint of training as a file beside its result.

use super::Console;
use crate::data::differences::first_difference;
use crate::data::{Provenance, weights};
use crate::error::{Error, Result};
use crate::learn::Checkpoint;
use std::fs;
use std::path::Path;

/// What a checkpoint's name has in place of the ending of the weights that it is for.
pub const ENDING: &str = "checkpoint.safetensors";

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
        Some(found) => Err(Error::input(
            path,
            format!("is the checkpoint of another run: {found}; go on with the old one, or give another --out; {anew}"),
        )),
    }
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
        // Of weights that go to a device nothing is kept, and a device stays.
        if !self.path.is_file() {
            return Ok(());
        }
        match fs::remove_file(self.path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Error::io(self.path, "remove", e)),
            _ => Ok(()),
        }
    }
}
