//! Datasets in LeRobotDataset v3.0 whoever wrote them, read as what they say of themselves: `meta/info.json` names the columns, `meta/episodes`
//! says how long the episodes are and in which file, and every frame says where it belongs. Nothing of it is believed that is not looked at.

mod columns;
mod content;
mod described;
mod description;
mod episodes;
mod flat;
mod frames;
mod learn;
mod names;
mod tasks;

pub use columns::Choice;
pub(super) use content::{column_order, content};
pub use described::described;
pub use description::{Declared, Info};
pub use episodes::EpisodeRow;
pub use learn::{Read, Source, open};
pub(super) use frames::{Frames, each};
pub use names::task_name;
pub use tasks::instructions;

use crate::error::Result;
use description::INFO;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// A dataset root that has been looked at: its description and its episodes.
#[derive(Clone, Debug, PartialEq)]
pub struct Root {
    /// Where it is.
    pub path: PathBuf,
    /// `meta/info.json`.
    pub info: Info,
    /// `meta/episodes`, in order.
    pub episodes: Vec<EpisodeRow>,
}

impl Root {
    /// Reads description and episodes, and checks them against each other.
    ///
    /// # Errors
    /// [`crate::error::Error::Input`] with the file, what is wrong and what to do.
    pub fn open(path: &Path) -> Result<Root> {
        let info = Info::read(path)?;
        let episodes = episodes::read(path, &info)?;
        Ok(Root { path: path.to_path_buf(), info, episodes })
    }

    /// Paths of the data files below the root, in the order of the episodes in them.
    fn data_files(&self) -> Vec<String> {
        let mut names: Vec<String> =
            self.episodes.iter().map(|episode| self.info.data_file(episode.chunk, episode.file)).collect();
        names.dedup();
        names
    }
}

/// Whether a directory is a dataset that hilt did not write, or holds two of them as `train` and `validation`. One that cannot be read is not.
pub fn is_foreign(dir: &Path) -> bool {
    [dir.to_path_buf(), dir.join(super::TRAIN)].iter().any(|root| {
        let text = std::fs::read(root.join(INFO)).ok();
        let value: Option<Value> = text.and_then(|text| serde_json::from_slice(&text).ok());
        value.is_some_and(|value| value.is_object() && value.get(crate::data::provenance::KEY).is_none())
    })
}

#[cfg(test)]
mod tests;
