//! What a stage has finished of an artefact that is not whole: `plans.unfinished/` beside `plans.parquet`, `recordings.unfinished/` beside
//! `recordings`. The same command goes on from there, on this machine or where the directories of several were copied together.
//!
//! Each run (settings, seed, inputs, version) has a directory of its own in there, named by the hash of its provenance: runs cannot take each other's
//! pieces, and none removes another's. A piece is a file under a name of its own, which appears whole or not at all.

use super::shard::Shard;
use super::{Console, places};
use crate::data::atomic::{self, Workplace};
use crate::data::differences::first_difference;
use crate::data::{ContentHash, Provenance};
use crate::error::{Error, Result};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use tempfile::TempDir;

/// What the directory's name ends with.
const ENDING: &str = "unfinished";
/// What the directory of a run begins with; digits of its hash follow.
const RUN: &str = "run-";
const DIGITS: usize = 16;

/// Where the pieces of a table at `out` go; `None` for a device or a pipe, beside which nothing can be kept.
///
/// # Errors
/// As [`atomic::target`].
pub fn beside_file(out: &Path) -> Result<Option<PathBuf>> {
    Ok(match atomic::target(out)? {
        atomic::Target::File(_) => Some(places::beside(&place(out)?, ENDING)),
        atomic::Target::Stream(_) => None,
    })
}

/// Where the pieces of a directory at `out` go. It may have any name: the ending is added to it.
///
/// # Errors
/// As [`atomic::follow`].
pub fn beside_dir(out: &Path) -> Result<PathBuf> {
    let place = place(out)?;
    let mut name = place.file_name().unwrap_or_default().to_os_string();
    name.push(format!(".{ENDING}"));
    Ok(place.with_file_name(name))
}

/// What is named, on the disk where it is: pieces are moved, not copied.
fn place(out: &Path) -> Result<PathBuf> {
    if out.is_symlink() || out.file_name().is_none() { atomic::follow(out) } else { Ok(out.to_path_buf()) }
}

/// The pieces of one run.
pub struct Unfinished<'a> {
    stage: &'static str,
    console: &'a Console,
    /// Of all runs.
    above: PathBuf,
    /// Of this run.
    dir: PathBuf,
    workplace: Workplace,
    /// Episodes that are to be done by this command, and how many are.
    total: u64,
    done: AtomicU64,
    /// Of a run whose pieces nobody can go on with.
    temporary: Option<TempDir>,
}

impl<'a> Unfinished<'a> {
    /// Of the run with this provenance, whose command has `total` episodes to do, in `place`; says which other runs have pieces there, whose origin
    /// `origin` reads.
    ///
    /// # Errors
    /// [`Error::Io`] when the directory cannot be made.
    pub fn begin(
        place: Option<PathBuf>,
        provenance: &Provenance,
        total: u64,
        stage: &'static str,
        console: &'a Console,
        origin: impl Fn(&Path) -> Result<Provenance>,
    ) -> Result<Self> {
        let temporary = place.is_none().then(tempfile::tempdir).transpose();
        let temporary = temporary.map_err(|e| Error::io(&std::env::temp_dir(), "create", e))?;
        let above = place.or_else(|| temporary.as_ref().map(|dir| dir.path().to_path_buf())).expect("one of the two is there");
        let hash = ContentHash::of(provenance.to_json().as_bytes()).to_string();
        let dir = above.join(format!("{RUN}{}", &hash[..DIGITS]));
        // What a killed process left while it removed its pieces lies above.
        Workplace::enter(&above)?;
        let workplace = Workplace::enter(&dir)?;
        let unfinished = Unfinished { stage, console, above, dir, workplace, total, done: AtomicU64::new(0), temporary };
        unfinished.say_of_others(provenance, origin);
        Ok(unfinished)
    }

    fn say_of_others(&self, ours: &Provenance, origin: impl Fn(&Path) -> Result<Provenance>) {
        let paths = |dir: &Path| fs::read_dir(dir).into_iter().flatten().flatten().map(|entry| entry.path());
        let is_run = |path: &PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(RUN));
        for other in paths(&self.above).filter(|path| is_run(path) && *path != self.dir) {
            let Some(theirs) = paths(&other).find_map(|piece| origin(&piece).ok()) else { continue };
            let (stage, dir) = (self.stage, other.display());
            let difference = first_difference(&theirs, ours).map_or_else(String::new, |found| format!(" ({found})"));
            self.console.say(&format!(
                "{stage}: {dir} holds pieces of another run{difference}, which stay: its own command goes on with them; remove them if nobody will"
            ));
        }
    }

    /// The place of a piece.
    pub fn at(&self, name: &str) -> PathBuf {
        self.dir.join(name)
    }

    /// The directory of this run.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// Says what is there already: this many episodes, and `damaged` pieces that are made again.
    pub fn say_found(&self, episodes: u64, damaged: usize) {
        self.done.fetch_add(episodes, Ordering::Relaxed);
        let (stage, total, dir) = (self.stage, self.total, self.dir.display());
        if damaged > 0 {
            self.console.say(&format!("{stage}: damaged pieces in {dir} are made again: {damaged}"));
        }
        if episodes > 0 {
            self.console.say(&format!("{stage}: goes on: {episodes} of {total} episodes are done, in {dir}"));
        }
    }

    /// Puts a piece of so many episodes in its place.
    ///
    /// # Errors
    /// [`Error::Io`] when the system refuses.
    pub fn put(&self, name: &str, bytes: &[u8], episodes: u64) -> Result<()> {
        atomic::write_piece(&self.at(name), bytes)?;
        self.done.fetch_add(episodes, Ordering::Relaxed);
        Ok(())
    }

    /// Says what to do with a share, when it is done.
    pub fn say_shared(&self, shard: Shard) {
        let (stage, total, above) = (self.stage, self.total, self.above.display());
        self.console.say(&format!(
            "{stage}: shard {shard} is done, {total} episodes: copy {above} of all shards together, then run the same command without --shard"
        ));
    }

    /// The error that ended the stage, with what was kept; nothing stays of a run that has finished nothing.
    pub fn explain(self, error: Error) -> Error {
        let (stage, done, total, dir) = (self.stage, self.done.load(Ordering::Relaxed), self.total, self.dir.display());
        if !self.dir.exists() {
            return Error::Failed(format!("{dir} is gone: the same command has ended elsewhere and put its result in place"));
        }
        if done == 0 || self.temporary.is_some() {
            let _ = self.workplace.remove(true).map(|_| fs::remove_dir(&self.above));
            return error;
        }
        let kept = format!("{done} of {total} episodes are kept in {dir}");
        if let Error::Interrupted = error {
            return Error::InterruptedAt(format!("{kept}: run the same command to go on"));
        }
        self.console.say(&format!("{stage}: {kept}: the same command goes on with them"));
        error
    }

    /// Removes the pieces once the artefact is in place; the last of several processes does.
    ///
    /// # Errors
    /// [`Error::Io`] when the system refuses.
    pub fn remove(self) -> Result<()> {
        if self.workplace.remove(false)? {
            // Other runs may have pieces there.
            let _ = fs::remove_dir(&self.above);
        } else {
            self.console.say(&format!("{}: {} stays: another process works on the same run", self.stage, self.dir.display()));
        }
        Ok(())
    }
}
