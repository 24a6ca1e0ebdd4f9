//! Datasets of demos on disk, in LeRobotDataset v3.0: `meta/info.json`, `meta/stats.json`, `meta/tasks.parquet`,
//! `meta/episodes/chunk-000/file-000.parquet` and `data/chunk-000/file-000.parquet` under one root.
//!
//! A frame is s_t, a_t and s_{t+1}: the `next.observation.*` columns carry the last state of an episode, which LeRobot's own
//! layout has no row for. Training and validation are two roots, each complete with its own statistics, so that nothing of the
//! validation episodes enters a normalisation. `meta/info.json` lists the content hash of every other file and seals itself.

mod check;
mod features;
mod meta;
mod read;
mod split;
mod stats;
mod twins;

pub use read::{Dataset, read, read_for};
pub use split::split;
pub use twins::{first_shared, first_twins};

use super::{Provenance, atomic, parquet_file};
use crate::demo::{Demo, Episode};
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use crate::tasks::Task;
use arrow_array::RecordBatch;
use arrow_schema::Schema;
use features::{Cells, Feature, features};
use meta::Place;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// A data file is closed once it is this big \[bytes\]: LeRobot's own 100 MB.
const DATA_FILE_BYTES: usize = meta::DATA_FILE_MB * 1_000_000;
/// Folder of the training root.
pub const TRAIN: &str = "train";
/// Folder of the validation root.
pub const VALIDATION: &str = "validation";

/// A demo and what the dataset keeps beside it.
#[derive(Clone, Debug)]
pub struct DatasetEpisode<'a> {
    /// Number of the episode in the recordings.
    pub source_index: u64,
    /// States and actions.
    pub demo: &'a Demo,
    /// r_t of each of the T actions: milestones reached by it.
    pub rewards: Vec<f32>,
    /// Whether the task is solved at the end.
    pub success: bool,
}

impl<'a> DatasetEpisode<'a> {
    /// Of a recorded episode and its demo. A recording notes a reward with the state that earns it; here it belongs to the
    /// action that led there.
    pub fn of(episode: &Episode, demo: &'a Demo) -> Self {
        let arrived = episode.steps.iter().skip(1).chain([&episode.last]);
        DatasetEpisode {
            source_index: episode.index,
            demo,
            rewards: arrived.map(|s| s.reward as f32).collect(),
            success: episode.success,
        }
    }
}

/// Writes one dataset; an older one there is replaced when the new one is whole.
///
/// # Errors
/// [`Error::Input`] without episodes, for a demo of another task, for rewards that do not fit or are not finite, or when the place
/// holds something else; [`Error::Io`] when the system refuses.
pub fn write(root: &Path, task: Task, episodes: &[DatasetEpisode], provenance: &Provenance) -> Result<()> {
    let content = Content { task, provenance, file_bytes: DATA_FILE_BYTES, interrupt: &Interrupt::default() };
    atomic::write_dir(root, meta::is_file, |dir| content.fill(dir, episodes))
}

/// Writes training and validation datasets as `parent/train` and `parent/validation`, both or none. Without validation episodes
/// there is no validation root.
///
/// # Errors
/// As [`write()`]; [`Error::Interrupted`].
pub fn write_split(
    parent: &Path,
    task: Task,
    train: &[DatasetEpisode],
    validation: &[DatasetEpisode],
    provenance: &Provenance,
    interrupt: &Interrupt,
) -> Result<()> {
    let content = Content { task, provenance, file_bytes: DATA_FILE_BYTES, interrupt };
    atomic::write_dir(parent, is_file, |dir| {
        for (name, episodes) in [(TRAIN, train), (VALIDATION, validation)] {
            if name == TRAIN || !episodes.is_empty() {
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

/// What the datasets of one call share.
struct Content<'a> {
    task: Task,
    provenance: &'a Provenance,
    /// A data file is closed once it is this big.
    file_bytes: usize,
    interrupt: &'a Interrupt,
}

impl Content<'_> {
    fn fill(&self, dir: &Path, episodes: &[DatasetEpisode]) -> Result<()> {
        check_episodes(dir, self.task, episodes)?;
        let features = features(self.task);
        let mut all = Vec::with_capacity(episodes.len());
        let mut first = 0;
        for (number, episode) in episodes.iter().enumerate() {
            self.interrupt.check()?;
            all.push(features::cells(self.task, episode, number, first));
            first += episode.demo.len();
        }
        let mut files = BTreeMap::new();
        let places = self.write_data(dir, &features, &all, &mut files)?;
        self.interrupt.check()?;
        meta::write(dir, self.task, &features, &all, &places, self.provenance, files)
    }

    /// Writes the data files, an episode a row group; adds their hashes to `files` and returns where each episode went.
    fn write_data(
        &self,
        dir: &Path,
        features: &[Feature],
        episodes: &[Vec<Cells>],
        files: &mut BTreeMap<String, String>,
    ) -> Result<Vec<Place>> {
        let schema = Arc::new(Schema::new(features.iter().map(features::field).collect::<Vec<_>>()));
        let mut places: Vec<Place> = Vec::with_capacity(episodes.len());
        let mut waiting = episodes;
        for number in 0.. {
            if waiting.is_empty() {
                break;
            }
            let place = Place::of_file(number);
            let name = place.data_path();
            let cannot = |e: &dyn std::fmt::Display| parquet_file::cannot_encode(&dir.join(&name), e);
            let mut writer = parquet_file::Writer::new(&schema, self.provenance).map_err(|e| cannot(&e))?;
            while let Some((cells, rest)) = waiting.split_first() {
                self.interrupt.check()?;
                let arrays = cells.iter().zip(features).map(|(c, f)| c.to_array(f.width)).collect();
                let batch = RecordBatch::try_new(Arc::clone(&schema), arrays).map_err(|e| cannot(&e))?;
                writer.row_group(&batch).map_err(|e| cannot(&e))?;
                places.push(place);
                waiting = rest;
                if writer.len() >= self.file_bytes {
                    break;
                }
            }
            meta::put(dir, &name, &writer.finish().map_err(|e| cannot(&e))?, files)?;
        }
        Ok(places)
    }
}

fn check_episodes(root: &Path, task: Task, episodes: &[DatasetEpisode]) -> Result<()> {
    if episodes.is_empty() {
        return Err(Error::input(root, "a dataset needs at least one episode, none is left"));
    }
    for episode in episodes {
        let (number, steps) = (episode.source_index, episode.demo.len());
        if episode.demo.task() != task {
            return Err(Error::input(root, format!("episode {number} is of {}, the dataset of {task}", episode.demo.task())));
        }
        if episode.rewards.len() != steps {
            return Err(Error::input(
                root,
                format!("episode {number} has {} rewards for {steps} actions", episode.rewards.len()),
            ));
        }
        if let Some(t) = episode.rewards.iter().position(|r| !r.is_finite()) {
            return Err(Error::input(root, format!("reward {t} of episode {number} is {}", episode.rewards[t])));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state::JOINTS;

    #[test]
    fn a_dataset_of_many_files_reads_as_one() {
        let (task, steps) = (Task::PickUp, 5);
        let make = |shift: f32| {
            let numbers = |n: usize| (0..n).map(|i| i as f32 * 0.01 + shift).collect::<Vec<f32>>();
            let demo = Demo::new(task, numbers((steps + 1) * task.state_dim()), numbers(steps * JOINTS), numbers(steps * JOINTS));
            demo.expect("a demo")
        };
        let demos: Vec<Demo> = (0..4).map(|i| make(i as f32)).collect();
        let episodes: Vec<DatasetEpisode> = demos
            .iter()
            .zip(10..)
            .map(|(demo, source_index)| DatasetEpisode { source_index, demo, rewards: vec![0.5; steps], success: true })
            .collect();
        let dir = tempfile::tempdir().expect("temporary directory");
        let provenance = Provenance::new("convert", task, serde_json::json!({}), 0);
        let content = Content { task, provenance: &provenance, file_bytes: 1, interrupt: &Interrupt::default() };
        content.fill(dir.path(), &episodes).expect("written");
        assert!(dir.path().join("data/chunk-000/file-003.parquet").is_file());
        let found = read(dir.path()).expect("readable");
        assert_eq!(found.demos, demos);
        assert_eq!(found.source_episodes, [10, 11, 12, 13]);
    }
}
