//! What a command reads and writes, checked before any work: nothing of the user's is replaced that the command does not replace on purpose.

use super::Console;
pub use super::content::{Content, EDITED};
use super::content::{check_ending, check_held};
use crate::data::atomic::{self, Target};
use crate::data::{dataset, recording, tensorboard};
use crate::error::{Error, Result};
use crate::interrupt;
use crate::report::experiments;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// Inputs and outputs of one command.
#[derive(Debug, Default)]
pub struct Places {
    reads: Vec<PathBuf>,
    writes: Vec<(&'static str, PathBuf, Content)>,
}

impl Places {
    /// None yet.
    pub fn new() -> Self {
        Places::default()
    }

    /// Adds an input.
    pub fn read(mut self, path: &Path) -> Self {
        self.reads.push(path.to_path_buf());
        self
    }

    /// Adds inputs.
    pub fn read_all<'a>(self, paths: impl IntoIterator<Item = &'a Path>) -> Self {
        paths.into_iter().fold(self, Places::read)
    }

    /// Adds an output; `name` is the flag that sets it, or what it is.
    pub fn write(mut self, name: &'static str, path: &Path, content: Content) -> Self {
        self.writes.push((name, path.to_path_buf(), content));
        self
    }

    /// Checks all of them, then begins the log.
    ///
    /// # Errors
    /// [`Error::Usage`] when an output has another format's ending, is an input or lies in one, is another output, or holds the artefact of
    /// another stage or program; [`Error::Input`] and [`Error::Io`] when it cannot be written there.
    pub fn check(mut self, console: &Console) -> Result<()> {
        if let Some(log) = console.log_path() {
            self = self.write("--log", log, Content::Log);
        }
        // A place on a file system that does not answer: a signal ends the process, nothing is lost.
        let waits = interrupt::waiting();
        for (name, path, content) in &self.writes {
            check_ending(name, path, *content)?;
        }
        self.check_apart()?;
        for (name, path, content) in &self.writes {
            check_held(name, path, *content)?;
            match content {
                Content::Recordings(_) => atomic::check_directory(path, recording::is_file)?,
                Content::Datasets(_) => atomic::check_directory(path, dataset::is_file)?,
                Content::Dataset => atomic::check_directory(path, dataset::is_root_file)?,
                Content::Report => atomic::check_directory(path, experiments::is_file)?,
                Content::Events => atomic::check_directory(path, tensorboard::is_file)?,
                Content::Pieces if path.is_file() => {
                    return Err(Error::input(path, "is a file, and what is finished is kept there until all is; move it away"));
                }
                Content::Pieces => atomic::check_place(&path.join("a piece"))?,
                _ => atomic::check_place(path)?,
            }
        }
        drop(waits);
        console.open_log()
    }

    /// No output is an input, or another output, or stands inside one.
    fn check_apart(&self) -> Result<()> {
        for (i, (name, path, _)) in self.writes.iter().enumerate() {
            let Some(place) = place_of(path)? else { continue };
            for input in &self.reads {
                let refused = |how: &str| {
                    let (path, input) = (path.display(), input.display());
                    Err(Error::Usage(format!("{name} {path}: {how} {input}, which this command reads; choose another place")))
                };
                match place_of(input)? {
                    Some(other) if same(&place, &other) => return refused("is"),
                    Some(other) if other.starts_with(&place) => return refused("would replace"),
                    Some(other) if place.starts_with(&other) => return refused("lies in"),
                    _ => {}
                }
            }
            for (other_name, other, _) in &self.writes[..i] {
                let apart = place_of(other)?
                    .is_none_or(|other| !same(&place, &other) && !other.starts_with(&place) && !place.starts_with(&other));
                if !apart {
                    let (path, other) = (path.display(), other.display());
                    let message =
                        format!("{other_name} {other} and {name} {path} are written by this command, to one place; choose two");
                    return Err(Error::Usage(message));
                }
            }
        }
        Ok(())
    }
}

/// The place of a file or directory, links followed; `None` for a device or a pipe, which takes any number of readers and writers.
fn place_of(path: &Path) -> Result<Option<PathBuf>> {
    if let Ok(found) = fs::canonicalize(path)
        && found.is_dir()
    {
        return Ok(Some(found));
    }
    match atomic::target(path) {
        Ok(Target::File(place)) => Ok(Some(place)),
        Ok(Target::Stream(_)) => Ok(None),
        // Said better where it is opened or written.
        Err(_) => Ok(Some(path.to_path_buf())),
    }
}

/// The same file, by its place or by another name of it.
fn same(one: &Path, other: &Path) -> bool {
    let number = |path: &Path| fs::metadata(path).map(|found| (found.dev(), found.ino())).ok();
    one == other || number(one).is_some_and(|n| number(other) == Some(n))
}

/// A file that goes beside `out`: its name with `ending` in place of the format's own, which [`Places`] has checked. Nothing goes beside a device or
/// a pipe.
pub fn beside(out: &Path, ending: &str) -> PathBuf {
    match atomic::target(out) {
        Ok(Target::Stream(_)) => PathBuf::from(NOWHERE),
        _ => out.with_extension(ending),
    }
}

/// What is written there is gone.
const NOWHERE: &str = "/dev/null";
