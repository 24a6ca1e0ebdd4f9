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
mod validate;

pub use columns::Choice;
pub(super) use content::{column_order, content};
pub use described::described;
pub use description::{Declared, Info};
pub use episodes::EpisodeRow;
pub(super) use frames::{Frames, each};
pub use learn::{Read, Source, open};
pub use names::task_name;
pub use tasks::instructions;
pub use validate::problems;

use super::check::DESCRIPTION;
use super::meta::LAYOUT;
use crate::data::{json_text, provenance};
use crate::error::Result;
use description::INFO;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// The stage that makes datasets of others.
pub(super) const STAGE: &str = "dataset";

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

/// Whether a directory is a dataset that is not of demos of hilt, or holds two of them as `train` and `validation`: of another program, or made of
/// such by `hilt dataset`. One that cannot be read is not.
pub fn is_foreign(dir: &Path) -> bool {
    descriptions(dir).any(|value| match value.get(provenance::KEY) {
        None => true,
        Some(hilt) => hilt.get(LAYOUT).is_none() && hilt["provenance"]["stage"] == STAGE,
    })
}

/// What a directory is or holds that `stage` of hilt did not write: a dataset of another program, or of another stage.
pub fn of_others(dir: &Path, stage: &str) -> Option<String> {
    descriptions(dir).find_map(|value| {
        let Some(hilt) = value.get(provenance::KEY) else {
            return Some("a dataset that hilt did not write".into());
        };
        let made_by = hilt["provenance"]["stage"].as_str()?;
        (made_by != stage).then(|| format!("a dataset of hilt {made_by}"))
    })
}

/// The descriptions of the dataset in a directory, or of the two in it, as far as they can be read.
fn descriptions(dir: &Path) -> impl Iterator<Item = Value> {
    let roots = [dir.to_path_buf(), dir.join(super::TRAIN), dir.join(super::VALIDATION)];
    let read = |root: PathBuf| json_text::parse::<Value>(&DESCRIPTION.read(&root.join(INFO)).ok()?).ok();
    roots.into_iter().filter_map(read).filter(Value::is_object)
}
