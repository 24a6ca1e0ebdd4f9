//! Datasets of demos on disk, in LeRobotDataset v3.0: `meta/info.json`, `meta/stats.json`, `meta/tasks.parquet`,
//! `meta/episodes/chunk-000/file-000.parquet` and `data/chunk-000/file-000.parquet` under one root.
//!
//! A frame is s_t, a_t and s_{t+1}: the `next.observation.*` columns carry the last state of an episode, which LeRobot's own
//! layout has no row for. Files are closed at 100 MB, as LeRobot's are: a larger dataset has several of each kind. Training and validation are two roots, each complete with its own statistics, so that nothing of the
//! validation episodes enters a normalisation. `meta/info.json` lists the content hash of every other file and seals itself.

mod check;
mod episodes;
mod features;
mod files;
mod meta;
mod read;
mod rows;
mod scratch;
mod split;
mod stats;
mod twins;
mod whole;
mod write;

pub use read::{Dataset, Description, each, read, read_for};
pub use split::split;
pub use twins::{Fingerprint, first_shared, first_twins};

use super::{Provenance, atomic};
use crate::demo::{Demo, Episode};
use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::tasks::Task;
use std::borrow::Cow;
use std::path::Path;
use write::Content;

/// Folder of the training root.
pub const TRAIN: &str = "train";
/// Folder of the validation root.
pub const VALIDATION: &str = "validation";

/// A demo and what the dataset keeps beside it.
#[derive(Clone, Debug)]
pub struct DatasetEpisode {
    /// Number of the episode in the recordings.
    pub source_index: u64,
    /// States and actions.
    pub demo: Demo,
    /// r_t of each of the T actions: milestones reached by it.
    pub rewards: Vec<f32>,
    /// Whether the task is solved at the end.
    pub success: bool,
}

impl DatasetEpisode {
    /// Of a recorded episode and its demo. A recording notes a reward with the state that earns it; here it belongs to the
    /// action that led there.
    pub fn of(episode: &Episode, demo: Demo) -> Self {
        let arrived = episode.steps.iter().skip(1).chain([&episode.last]);
        DatasetEpisode {
            source_index: episode.index,
            demo,
            rewards: arrived.map(|s| s.reward as f32).collect(),
            success: episode.success,
        }
    }

    /// Bytes of its numbers.
    pub fn bytes(&self) -> usize {
        let numbers = [self.demo.states(), self.demo.actions(), self.demo.executed(), &self.rewards];
        numbers.iter().map(|n| size_of_val(*n)).sum()
    }
}

/// What gives the episode at a position.
type Give<'a> = Box<dyn Fn(usize) -> Result<Cow<'a, DatasetEpisode>> + Sync + 'a>;

/// The episodes that a dataset is made of, each asked for once, on any thread, when its turn comes.
pub struct Episodes<'a> {
    /// T of each.
    steps: Vec<usize>,
    give: Give<'a>,
}

impl<'a> Episodes<'a> {
    /// Episodes of so many `steps`; `give` has the one at a position.
    pub fn new(steps: Vec<usize>, give: impl Fn(usize) -> Result<Cow<'a, DatasetEpisode>> + Sync + 'a) -> Self {
        Episodes { steps, give: Box::new(give) }
    }
}

impl<'a> From<&'a [DatasetEpisode]> for Episodes<'a> {
    fn from(all: &'a [DatasetEpisode]) -> Self {
        Episodes::new(all.iter().map(|episode| episode.demo.len()).collect(), |at| Ok(Cow::Borrowed(&all[at])))
    }
}

/// What a dataset root carries of its origin, read from its description alone.
///
/// # Errors
/// [`crate::error::Error::Input`] when the root is no dataset or its description was changed.
pub fn provenance(root: &Path) -> Result<Provenance> {
    check::info(root).map(|info| info.provenance)
}

/// Writes one dataset; an older one there is replaced when the new one is whole.
///
/// # Errors
/// [`crate::error::Error::Input`] without episodes, for a demo of another task, for rewards that do not fit or are not finite, or when the place
/// holds something else; [`crate::error::Error::Io`] when the system refuses; what giving an episode returns.
pub fn write(root: &Path, task: Task, episodes: &Episodes, provenance: &Provenance) -> Result<()> {
    let interrupt = Interrupt::default();
    let content = Content::new(task, provenance, &interrupt);
    atomic::write_dir(root, meta::is_file, |dir| content.fill(dir, episodes))
}

/// Writes training and validation datasets as `parent/train` and `parent/validation`, both or none. Without validation episodes
/// there is no validation root.
///
/// # Errors
/// As [`write()`]; [`crate::error::Error::Interrupted`].
pub fn write_split<'a>(
    parent: &Path,
    task: Task,
    train: &Episodes<'a>,
    validation: &Episodes<'a>,
    provenance: &Provenance,
    interrupt: &Interrupt,
) -> Result<()> {
    let content = Content::new(task, provenance, interrupt);
    atomic::write_dir(parent, is_file, |dir| {
        for (name, episodes) in [(TRAIN, train), (VALIDATION, validation)] {
            if name == TRAIN || !episodes.steps.is_empty() {
                content.fill(&dir.join(name), episodes)?;
            }
        }
        Ok(())
    })
}

/// Whether a path below the two datasets is one of theirs.
pub fn is_file(path: &Path) -> bool {
    [TRAIN, VALIDATION].iter().any(|name| path.strip_prefix(name).is_ok_and(meta::is_file))
}

#[cfg(test)]
mod tests;
