//! Reading a dataset back into demos, with every doubt said in words.

use super::check::DESCRIPTION;
use super::check::{self, Info};
use super::features::{
    ACTION, DONE, ENVIRONMENT, EPISODE, EXECUTED, FRAME, INDEX, Kind, NEXT_ENVIRONMENT, NEXT_STATE, REWARD, SOURCE, STATE,
    SUCCESS, features,
};
use super::meta::{INFO, is_file};
use crate::data::{ContentHash, Provenance, parquet_file};
use crate::demo::Demo;
use crate::error::{Error, Result};
use crate::tasks::Task;
use arrow_array::cast::AsArray;
use arrow_array::types::{Float32Type, Int64Type};
use arrow_array::{Array, RecordBatch};
use std::collections::BTreeMap;
use std::path::Path;

/// A dataset in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Dataset {
    /// The task.
    pub task: Task,
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

/// Reads a dataset root (`dataset/train` or `dataset/validation`).
///
/// # Errors
/// [`Error::Input`] with the file and the reason: no dataset, another layout or schema version, features that do not fit the task, a
/// missing, damaged or rewritten file, a number that is not finite (by column and row), lengths that disagree. [`Error::Io`] when
/// something cannot be read at all.
pub fn read(root: &Path) -> Result<Dataset> {
    let info = check::info(root)?;
    let mut columns = Columns::default();
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
            columns.append(&path, info.task, bytes).map_err(|why| also_rewritten(why, rewritten.as_deref()))?;
        }
    }
    // What another program rewrote may break the rules as well, which says more.
    match (columns.into_dataset(root, info, files), rewritten) {
        (Err(why), rewritten) => Err(also_rewritten(why, rewritten.as_deref())),
        (Ok(_), Some(path)) => Err(Error::input(&path, "was rewritten by another program; run hilt convert again")),
        (Ok(dataset), None) => Ok(dataset),
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
pub fn read_for(root: &Path, task: Task) -> Result<Dataset> {
    let dataset = read(root)?;
    if dataset.task != task {
        let (found, dim, wanted) = (dataset.task, dataset.task.state_dim(), task.state_dim());
        let message = format!("is a dataset of {found} (states of {dim} numbers), not of {task} ({wanted})");
        return Err(Error::input(root, message));
    }
    Ok(dataset)
}

/// All columns over all data files.
#[derive(Default)]
struct Columns {
    floats: BTreeMap<&'static str, Vec<f32>>,
    ints: BTreeMap<&'static str, Vec<i64>>,
    flags: BTreeMap<&'static str, Vec<bool>>,
}

impl Columns {
    /// Adds the rows of one file.
    fn append(&mut self, path: &Path, task: Task, bytes: Vec<u8>) -> Result<()> {
        let (_, batches) = parquet_file::decode(bytes).map_err(|e| Error::input(path, format!("cannot be decoded: {e}")))?;
        for batch in &batches {
            self.append_batch(path, task, batch)?;
        }
        Ok(())
    }

    fn append_batch(&mut self, path: &Path, task: Task, batch: &RecordBatch) -> Result<()> {
        for feature in features(task) {
            let (name, width) = (feature.name, feature.width);
            let wrong = |what: String| Error::input(path, format!("column {name} {what}"));
            let column = batch.column_by_name(name).ok_or_else(|| wrong("is missing".into()))?;
            let expected = super::features::field(&feature);
            if column.null_count() > 0 {
                return Err(wrong("has empty cells".into()));
            }
            if !expected.data_type().equals_datatype(column.data_type()) {
                return Err(wrong(format!("has type {}, {task} has {}", column.data_type(), expected.data_type())));
            }
            match feature.kind {
                Kind::I64 => self.ints.entry(name).or_default().extend(column.as_primitive::<Int64Type>().values()),
                Kind::Bool => self.flags.entry(name).or_default().extend(column.as_boolean().values().iter()),
                Kind::F32 => {
                    let known = self.floats.entry(name).or_default();
                    let values = if width == 1 { column } else { column.as_fixed_size_list().values() };
                    let values = values.as_primitive::<Float32Type>().values();
                    check::finite(path, name, width, known.len() / width, values)?;
                    known.extend(values);
                }
            }
        }
        Ok(())
    }

    fn into_dataset(self, root: &Path, info: Info, files: BTreeMap<String, ContentHash>) -> Result<Dataset> {
        let ranges = self.episodes(root, &info)?;
        let mut dataset = Dataset {
            task: info.task,
            fps: info.fps,
            demos: Vec::new(),
            rewards: Vec::new(),
            successes: Vec::new(),
            source_episodes: Vec::new(),
            provenance: info.provenance,
            files,
        };
        for (number, range) in ranges.into_iter().enumerate() {
            let wrong = |what: String| Error::input(root, format!("episode {number}: {what}"));
            let states = self.states(info.task, range.clone()).map_err(wrong)?;
            let rows = |name: &str, width: usize| self.floats[name][range.start * width..range.end * width].to_vec();
            let width = self.floats[ACTION].len() / info.frames;
            let demo = Demo::new(info.task, states, rows(ACTION, width), rows(EXECUTED, width)).map_err(wrong)?;
            dataset.demos.push(demo);
            dataset.rewards.push(rows(REWARD, 1));
            dataset.successes.push(self.flags[SUCCESS][range.end - 1]);
            dataset.source_episodes.push(self.ints[SOURCE][range.start] as u64);
        }
        Ok(dataset)
    }

    /// The frames of each episode, after checking the counts.
    fn episodes(&self, root: &Path, info: &Info) -> Result<Vec<std::ops::Range<usize>>> {
        let done = self.flags.get(DONE).map_or(&[][..], Vec::as_slice);
        let ends: Vec<usize> = done.iter().enumerate().filter(|(_, d)| **d).map(|(t, _)| t + 1).collect();
        if done.len() == info.frames && ends.len() == info.episodes && ends.last() != Some(&done.len()) {
            return Err(Error::input(
                root,
                format!("its last frame ends no episode ({DONE} is false there): the rows are not in their order"),
            ));
        }
        if done.len() != info.frames || ends.len() != info.episodes || done.is_empty() {
            let message = format!(
                "meta/info.json says {} episodes of {} frames, the data has {} of {}",
                info.episodes,
                info.frames,
                ends.len(),
                done.len()
            );
            return Err(Error::input(root, message));
        }
        let starts = [0].into_iter().chain(ends.iter().copied());
        let ranges: Vec<_> = starts.zip(&ends).map(|(start, end)| start..*end).collect();
        for (number, range) in ranges.iter().enumerate() {
            for t in range.clone() {
                let found = [self.ints[INDEX][t], self.ints[EPISODE][t], self.ints[FRAME][t]];
                let expected = [t as i64, number as i64, (t - range.start) as i64];
                if found != expected {
                    let message = format!("row {t} has [{INDEX}, {EPISODE}, {FRAME}] = {found:?}, expected {expected:?}");
                    return Err(Error::input(root, message));
                }
            }
        }
        Ok(ranges)
    }

    /// The T + 1 states of an episode; each `next` must be what the following frame begins with.
    fn states(&self, task: Task, range: std::ops::Range<usize>) -> std::result::Result<Vec<f32>, String> {
        let body = super::features::PROPRIOCEPTION;
        let world = task.state_dim() - body;
        let row = |name: &str, width: usize, t: usize| &self.floats[name][t * width..(t + 1) * width];
        let state = |t: usize| [row(STATE, body, t), row(ENVIRONMENT, world, t)].concat();
        let next = |t: usize| [row(NEXT_STATE, body, t), row(NEXT_ENVIRONMENT, world, t)].concat();
        let last = range.end - 1;
        if let Some(t) = (range.start..last).find(|t| next(*t) != state(t + 1)) {
            return Err(format!("next.observation of frame {} is not the observation of the frame after it", t - range.start));
        }
        Ok(range.flat_map(state).chain(next(last)).collect())
    }
}
