//! Metrics of trainings, from whatever was named: runs, tables, metrics as they come.

use crate::data::peek::{Format, peek};
use crate::data::{live_file, table_file, tensorboard};
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use crate::table::{Table, Values};
use std::fs;
use std::path::{Path, PathBuf};

/// Endings of the tables of metrics that stages write.
const TABLES: [&str; 2] = [".training.parquet", ".pretraining.parquet"];
/// Endings of the same metrics as they come.
pub const LIVE: [&str; 2] = [".training.jsonl", ".pretraining.jsonl"];
/// Of which the second is of the dynamics network.
const PRETRAINING: usize = 1;
/// Columns that say where training stood.
pub(super) const PLACE: [&str; 3] = ["stage", "epoch", "updates"];

/// The metrics of one training.
#[derive(Clone, Debug)]
pub struct Source {
    /// The file.
    pub path: PathBuf,
    /// What it is called beside the others.
    pub name: String,
    /// A row an epoch.
    pub metrics: Table,
}

/// The metrics of everything that was named, each with a name of its own.
///
/// # Errors
/// [`Error::Input`] for a run without metrics, and for a file that holds none; what reading returns.
pub fn sources(named: &[PathBuf], interrupt: &Interrupt) -> Result<Vec<Source>> {
    let mut found = Vec::new();
    for path in named {
        interrupt.check()?;
        for file in if path.is_dir() { of_run(path)? } else { vec![path.clone()] } {
            found.push(read(&file)?);
        }
    }
    name(&mut found);
    Ok(found)
}

/// The files of metrics in a run: of a training that goes on, or was stopped, those that it has written so far.
fn of_run(dir: &Path) -> Result<Vec<PathBuf>> {
    let files = files_in(dir)?;
    let mut found: Vec<PathBuf> = files.iter().filter(|file| ends_in(file, &TABLES)).cloned().collect();
    for live in files.iter().filter(|file| ends_in(file, &LIVE)) {
        let table = live.with_extension("parquet");
        let newer = |one: &Path, other: &Path| {
            let time = |path: &Path| fs::metadata(path).and_then(|found| found.modified()).ok();
            time(one) > time(other)
        };
        if !table.is_file() {
            found.push(live.clone());
        } else if newer(live, &table) {
            found.retain(|file| *file != table);
            found.push(live.clone());
        }
    }
    // policy.training.parquet before policy-bc.training.parquet.
    found.sort_by_key(|file| stem(file));
    if found.is_empty() {
        let message = "holds no metrics of a training (policy.training.parquet, dynamics.pretraining.parquet); hilt runs lists the runs below it";
        return Err(Error::input(dir, message));
    }
    Ok(found)
}

pub(super) fn ends_in(file: &Path, endings: &[&str]) -> bool {
    file.to_str().is_some_and(|name| endings.iter().any(|ending| name.ends_with(ending)))
}

pub(super) fn files_in(dir: &Path) -> Result<Vec<PathBuf>> {
    let entries = fs::read_dir(dir).map_err(|e| Error::io(dir, "read", e))?;
    Ok(entries.filter_map(|entry| entry.ok()).map(|entry| entry.path()).filter(|path| path.is_file()).collect())
}

/// Whether metrics as they come are those of a dynamics network.
pub fn is_pretraining(live: &Path) -> bool {
    ends_in(live, &LIVE[PRETRAINING..])
}

/// The metrics of trainings in `dir` as they come, the newest first.
///
/// # Errors
/// [`Error::Io`] when the directory cannot be read.
pub fn live_of(dir: &Path) -> Result<Vec<PathBuf>> {
    let mut found: Vec<PathBuf> = files_in(dir)?.into_iter().filter(|file| ends_in(file, &LIVE)).collect();
    found.sort_by_key(|file| std::cmp::Reverse(fs::metadata(file).and_then(|found| found.modified()).ok()));
    Ok(found)
}

fn read(path: &Path) -> Result<Source> {
    let format = peek(path).map_err(|e| Error::io(path, "read", e))?.format;
    let live = path.extension().is_some_and(|ending| ending == live_file::ENDING);
    let (metrics, method) = match format {
        _ if live => (live_file::read(path)?, None),
        Format::Parquet => {
            let (metrics, made) = table_file::read(path)?;
            (metrics, made.settings["method"].as_str().map(String::from))
        }
        _ => {
            let message = "holds no metrics of a training; expected policy.training.parquet, dynamics.pretraining.parquet, what --live of hilt train or pretrain writes, dynamics.errors.parquet, or a run";
            return Err(Error::input(path, message));
        }
    };
    let is_place = |name: &str| {
        let values = metrics.column(name).map(|column| &column.values);
        matches!((name, values), ("stage", Some(Values::Text(_))) | ("epoch" | "updates", Some(Values::I64(_))))
    };
    if !PLACE.into_iter().all(is_place) {
        let names: Vec<&str> = metrics.columns.iter().map(|column| column.name.as_str()).take(4).collect();
        let message = format!(
            "is no table of epochs (its columns are {}, ...); expected policy.training.parquet or dynamics.pretraining.parquet",
            names.join(", ")
        );
        return Err(Error::input(path, message));
    }
    let name = method.unwrap_or_else(|| stem(path));
    Ok(Source { path: path.to_path_buf(), name, metrics })
}

/// `policy-bc` of `policy-bc.training.parquet`.
pub(super) fn stem(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    name.split('.').next().unwrap_or_default().to_string()
}

/// Names that tell the sources apart: by method; then with the run before; then by path.
fn name(sources: &mut [Source]) {
    let unique = |sources: &[Source]| {
        let same = |a: &Source, b: &Source| a.name == b.name;
        (0..sources.len()).all(|i| (0..i).all(|j| !same(&sources[i], &sources[j])))
    };
    if unique(sources) {
        return;
    }
    let mut with_run = sources.to_vec();
    for source in &mut with_run {
        let run = source.path.parent().and_then(Path::file_name).unwrap_or_default().to_string_lossy().into_owned();
        source.name = format!("{run} {}", source.name);
    }
    let by_run = unique(&with_run);
    for (source, with_run) in sources.iter_mut().zip(with_run) {
        source.name = if by_run { with_run.name } else { source.path.display().to_string() };
    }
}

impl Source {
    /// Its directory in an export: `policy-bc`, with the run before where that is needed.
    pub fn place(&self) -> PathBuf {
        let plain = |c: char| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' };
        let name: String = self.name.chars().map(plain).collect();
        PathBuf::from(name.trim_matches(['.', '-']).to_string())
    }

    /// The table as an event file of TensorBoard's.
    pub fn events(&self) -> Vec<u8> {
        let numbers: Vec<(&str, &str, Vec<f64>)> = self
            .metrics
            .columns
            .iter()
            .filter_map(|column| {
                let values = numbers(&column.values).filter(|_| !PLACE.contains(&column.name.as_str()))?;
                Some((column.name.as_str(), column.doc.as_str(), values))
            })
            .collect();
        let (mut bytes, mut steps) = (tensorboard::head(), tensorboard::Steps::default());
        for row in 0..self.metrics.rows() {
            let scalars: Vec<tensorboard::Scalar> =
                numbers.iter().map(|(name, doc, values)| (*name, *doc, values[row])).collect();
            bytes.extend(steps.next(&scalars));
        }
        bytes
    }
}

/// A column of numbers.
pub(super) fn numbers(values: &Values) -> Option<Vec<f64>> {
    match values {
        Values::F32(v) => Some(v.iter().map(|x| f64::from(*x)).collect()),
        Values::F64(v) => Some(v.clone()),
        Values::I64(v) => Some(v.iter().map(|x| *x as f64).collect()),
        Values::Bool(_) | Values::Text(_) => None,
    }
}
