//! Datasets of demos on disk, in LeRobotDataset v3.0: `meta/info.json`, `meta/stats.json`, `meta/tasks.parquet`,
//! `meta/episodes/chunk-000/file-000.parquet` and `data/chunk-000/file-000.parquet` under one root.
//!
//! A frame is s_t, a_t and s_{t+1}: the `next.observation.*` columns carry the last state of an episode, which LeRobot's own
//! layout has no row for. Files are closed at 100 MB, as LeRobot's are: a larger dataset has several of each kind. Training and validation are two roots, each complete with its own statistics, so that nothing of the
//! validation episodes enters a normalisation. `meta/info.json` lists the content hash of every other file and seals itself.

mod cells;
mod check;
pub mod edit;
mod episode;
mod episodes;
mod features;
mod files;
pub mod foreign;
mod meta;
mod read;
mod rows;
mod scratch;
mod sizes;
mod split;
mod stats;
mod twins;
mod whole;
mod write;

pub use episode::{DatasetEpisode, Episodes};
pub(in crate::data) use features::names;
pub use meta::{TRAIN, VALIDATION};
pub use read::{Dataset, Description, each, read, read_for};
pub use split::split;
pub use twins::{Fingerprint, first_shared, first_twins};

use super::{Provenance, atomic};
use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::robot::Robot;
use crate::task::Task;
use std::path::Path;
use write::Content;

/// What a dataset root carries of its origin, read from its description alone.
///
/// # Errors
/// [`crate::error::Error::Input`] when the root is no dataset or its description was changed.
pub fn provenance(root: &Path) -> Result<Provenance> {
    check::info(root).map(|info| info.provenance)
}

/// Steps of all episodes of a dataset, as its description counts them.
///
/// # Errors
/// As [`provenance`].
pub fn frames(root: &Path) -> Result<usize> {
    check::info(root).map(|info| info.frames)
}

/// Its episodes, as its description counts them.
///
/// # Errors
/// As [`provenance`].
pub fn episodes(root: &Path) -> Result<usize> {
    check::info(root).map(|info| info.episodes)
}

/// Writes one dataset of a robot in a task; an older one there is replaced when the new one is whole.
///
/// # Errors
/// [`crate::error::Error::Input`] without episodes, for a demo of another task, for rewards that do not fit or are not finite, or when the place
/// holds something else; [`crate::error::Error::Io`] when the system refuses; what giving an episode returns.
pub fn write(root: &Path, of: (&Robot, &Task), episodes: &Episodes, provenance: &Provenance) -> Result<()> {
    let interrupt = Interrupt::default();
    let content = Content::new(of, provenance, &interrupt);
    atomic::write_dir(root, meta::is_file, |dir| content.fill(dir, episodes))
}

/// Writes training and validation datasets as `parent/train` and `parent/validation`, both or none. Without validation episodes
/// there is no validation root.
///
/// # Errors
/// As [`write()`]; [`crate::error::Error::Interrupted`].
pub fn write_split<'a>(
    parent: &Path,
    of: (&Robot, &Task),
    train: &Episodes<'a>,
    validation: &Episodes<'a>,
    provenance: &Provenance,
    interrupt: &Interrupt,
) -> Result<()> {
    let content = Content::new(of, provenance, interrupt);
    atomic::write_dir(parent, is_file, |dir| {
        for (name, episodes) in [(TRAIN, train), (VALIDATION, validation)] {
            if name == TRAIN || !episodes.steps.is_empty() {
                content.fill(&dir.join(name), episodes)?;
            }
        }
        Ok(())
    })
}

/// Whether a path below one dataset's root is one of it.
pub fn is_root_file(path: &Path) -> bool {
    meta::is_file(path)
}

/// Whether a path below the two datasets is one of theirs.
pub fn is_file(path: &Path) -> bool {
    [TRAIN, VALIDATION].iter().any(|name| path.strip_prefix(name).is_ok_and(meta::is_file))
}

#[cfg(test)]
mod tests;
