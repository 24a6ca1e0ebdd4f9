//! Reading a dataset back into demos, with every doubt said in words.

use super::DatasetEpisode;
use super::check::{self, DESCRIPTION};
use super::meta::{INFO, is_file};
use super::rows::Rows;
use crate::data::{ContentHash, Provenance, parquet_file};
use crate::demo::Demo;
use crate::error::{Error, Result};
use crate::layout::Layout;
use crate::robot::file::built_in::paper_robot;
use crate::task::{Task, built_in};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// A dataset in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Dataset {
    /// The task's name.
    pub task: String,
    /// What its rows hold.
    pub layout: Arc<Layout>,
    /// Control rate \[Hz\].
    pub fps: u32,
    /// The demos.
    pub demos: Vec<Demo>,
    /// r_t of each demo.
    pub rewards: Vec<Vec<f32>>,
    /// Whether each demo ends in success.
    pub successes: Vec<bool>,
    /// Number of each demo's episode in the recordings.
    pub source_episodes: Vec<u64>,
    /// Where the dataset came from.
    pub provenance: Provenance,
    /// The files that were read, by path below the root.
    pub files: BTreeMap<String, ContentHash>,
}

/// What a dataset is, its episodes aside.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// The task's name.
    pub task: String,
    /// What its rows hold.
    pub layout: Arc<Layout>,
    /// Control rate \[Hz\].
    pub fps: u32,
    /// Where the dataset came from.
    pub provenance: Provenance,
    /// The files that were read, by path below the root.
    pub files: BTreeMap<String, ContentHash>,
}

/// Reads a dataset root (`dataset/train` or `dataset/validation`).
///
/// # Errors
/// [`Error::Input`] with the file and the reason: no dataset, another layout or schema version, features that do not fit the task, a
/// missing, damaged or rewritten file, a number that is not finite (by column and row), lengths that disagree. [`Error::Io`] when
/// something cannot be read at all.
pub fn read(root: &Path) -> Result<Dataset> {
    let (mut demos, mut rewards, mut successes, mut source_episodes) = (vec![], vec![], vec![], vec![]);
    let Description { task, layout, fps, provenance, files } = each(root, |episode| {
        demos.push(episode.demo);
        rewards.push(episode.rewards);
        successes.push(episode.success);
        source_episodes.push(episode.source_index);
        Ok(())
    })?;
    Ok(Dataset { task, layout, fps, demos, rewards, successes, source_episodes, provenance, files })
}

/// As [`read`], in the memory of one file: shows every episode to `see`, in order, until that fails. What was shown counts only when all
/// could be read.
///
/// # Errors
/// As [`read`], and what `see` returns.
pub fn each(root: &Path, see: impl FnMut(DatasetEpisode) -> Result<()>) -> Result<Description> {
    let info = check::info(root)?;
    let mut rows = Rows::new(&info.layout, see);
    let mut rewritten = None;
    let mut files = BTreeMap::from([(INFO.to_string(), info.hash)]);
    for name in info.files.keys() {
        if !is_file(Path::new(name)) {
            return Err(Error::input(
                &root.join(INFO),
                format!("lists \"{name}\", which is no file of a dataset; run hilt convert again"),
            ));
        }
        let path = root.join(name);
        if !path.is_file() {
            return Err(Error::input(&path, "is missing; the dataset is incomplete, run hilt convert again"));
        }
        let bytes = if name.ends_with(".parquet") { parquet_file::FORMAT.read(&path)? } else { DESCRIPTION.read(&path)? };
        let hash = ContentHash::of(&bytes);
        let untouched = info.files.get(name).is_some_and(|h| *h == hash.to_string());
        files.insert(name.clone(), hash);
        if !untouched && !parquet_file::is_foreign(&bytes) {
            return Err(Error::input(&path, "damaged: its content does not match meta/info.json; run hilt convert again"));
        }
        if !untouched {
            rewritten = Some(path.clone());
        }
        if name.starts_with("data/") {
            rows.append(&path, bytes).map_err(|why| also_rewritten(why, rewritten.as_deref()))?;
        }
    }
    // What another program rewrote may break the rules as well, which says more.
    match (rows.finish(root, &info), rewritten) {
        (Err(why), rewritten) => Err(also_rewritten(why, rewritten.as_deref())),
        (Ok(()), Some(path)) => Err(Error::input(&path, "was rewritten by another program; run hilt convert again")),
        (Ok(()), None) => {
            Ok(Description { task: info.task, layout: info.layout, fps: info.fps, provenance: info.provenance, files })
        }
    }
}

/// An error of a dataset, of which another program rewrote a file.
fn also_rewritten(error: Error, rewritten: Option<&Path>) -> Error {
    match (error, rewritten) {
        (Error::Input { path, message }, Some(file)) => {
            let file = file.file_name().unwrap_or_default().display();
            Error::Input { path, message: format!("{message}; {file} was rewritten by another program, run hilt convert again") }
        }
        (other, _) => other,
    }
}

/// As [`read`], for a task that is known already.
///
/// # Errors
/// As [`read`], and [`Error::Input`] for a dataset of another task.
pub fn read_for(root: &Path, task: &str) -> Result<Dataset> {
    let dataset = read(root)?;
    if dataset.task != task {
        // What a task adds to the joints does not depend on the robot.
        let joints = |layout: &Layout| layout.positions().len() + layout.velocities().len();
        let beside = |layout: &Layout| layout.state_dim() - joints(layout);
        let (found, layout) = (&dataset.task, &dataset.layout);
        let wanted = |task: Arc<Task>| format!(" ({})", joints(layout) + beside(&task.layout(&paper_robot())));
        let (dim, wanted) = (layout.state_dim(), built_in::find(task).map(wanted).unwrap_or_default());
        return Err(Error::input(root, format!("is a dataset of {found} (states of {dim} numbers), not of {task}{wanted}")));
    }
    Ok(dataset)
}
