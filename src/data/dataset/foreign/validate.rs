//! Everything that is wrong with a dataset, not only the first of it: what LeRobot needs to load it, and what learning needs beyond.

use super::description::{Declared, Info};
use super::episodes::below;
use super::flat;
use super::{Root, instructions, is_foreign};
use crate::data::dataset::features::{Cells, EPISODE, FRAME, INDEX, Kind, TASK, TIMESTAMP};
use crate::data::dataset::meta::{DATA, STATS, TASKS};
use crate::data::dataset::{check::DESCRIPTION, read};
use crate::data::parquet_stream::Stream;
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use arrow_array::RecordBatch;
use serde_json::Value;
use std::path::Path;

/// The columns that LeRobot takes for granted, with their types.
const DEFAULTS: [(&str, &[&str]); 5] =
    [(TIMESTAMP, &["float32", "float64"]), (FRAME, &["int64"]), (EPISODE, &["int64"]), (INDEX, &["int64"]), (TASK, &["int64"])];
/// How far a timestamp may be from frame_index / fps \[s\]: LeRobot's own tolerance.
const TOLERANCE_S: f64 = 1e-4;
/// Statistics that LeRobot normalises with.
const STATISTICS: [&str; 4] = ["min", "max", "mean", "std"];

/// All problems of the dataset at `root`, in words; none for a sound one.
///
/// # Errors
/// [`Error::Interrupted`]; what cannot be read at all is a problem.
pub fn problems(root: &Path, interrupt: &Interrupt) -> Result<Vec<String>> {
    let mut found = Problems::default();
    let info = match Info::read(root) {
        Ok(info) => info,
        Err(why) => {
            found.take(root, Err(why));
            return Ok(found.said);
        }
    };
    if !is_foreign(root) {
        // Its seal and its own rules.
        found.take(root, read::each(root, |_| ()).map(drop));
    }
    described(&info, &mut found);
    let opened = Root::open(root);
    let instructions = instructions(root);
    let tasks = instructions.as_ref().map_or(0, Vec::len);
    if !root.join(TASKS).is_file() {
        found.say(format!("{TASKS} is missing: LeRobot does not load the dataset without it"));
    }
    found.take(root, instructions.map(drop));
    statistics(root, &info, &mut found);
    match opened {
        Ok(opened) => Scan { root: &opened, tasks, found: &mut found, rows: 0, told: Vec::new() }.all(interrupt)?,
        Err(why) => found.take(root, Err(why)),
    }
    found.said.dedup();
    Ok(found.said)
}

#[derive(Default)]
struct Problems {
    said: Vec<String>,
}

impl Problems {
    fn say(&mut self, what: String) {
        if !self.said.contains(&what) {
            self.said.push(what);
        }
    }

    /// An error is a problem, named below the root.
    fn take(&mut self, root: &Path, result: Result<()>) {
        if let Err(why) = result {
            let why = why.to_string();
            let short =
                why.strip_prefix(&format!("{}/", root.display())).or_else(|| why.strip_prefix(&format!("{}: ", root.display())));
            self.say(short.unwrap_or(&why).to_string());
        }
    }
}

fn described(info: &Info, found: &mut Problems) {
    for (name, types) in DEFAULTS {
        match info.feature(name) {
            None => found.say(format!("meta/info.json declares no column {name}, which every dataset has")),
            Some(column) if column.shape != [1] || !types.contains(&column.dtype.as_str()) => {
                let (dtype, shape) = (&column.dtype, &column.shape);
                found.say(format!("meta/info.json declares {name} as {dtype} {shape:?}; expected {} [1]", types[0]));
            }
            Some(_) => {}
        }
    }
    for column in &info.features {
        if column.name.contains('/') {
            found.say(format!("column {} has a / in its name, which LeRobot refuses; use dots", column.name));
        }
    }
    if info.fps.fract() != 0.0 {
        found.say(format!("meta/info.json has {} frames per second; LeRobot's fps is a whole number", info.fps));
    }
}

fn statistics(root: &Path, info: &Info, found: &mut Problems) {
    let path = root.join(STATS);
    if !path.is_file() {
        found.say(format!("{STATS} is missing: LeRobot normalises with it (hilt dataset convert writes it anew)"));
        return;
    }
    let bytes = match DESCRIPTION.read(&path) {
        Ok(bytes) => bytes,
        Err(why) => return found.take(root, Err(why)),
    };
    // Python writes NaN and Infinity, which JSON has not.
    let Ok(value) = serde_json::from_slice::<Value>(&bytes) else {
        return found.say(format!("{STATS} is no JSON, or holds NaN or Infinity"));
    };
    for column in info.features.iter().filter(|column| column.is_numeric()) {
        for name in STATISTICS {
            let numbers = value.get(&column.name).and_then(|of| of.get(name));
            let mut flat = Vec::new();
            numbers.into_iter().for_each(|numbers| flatten(numbers, &mut flat));
            if flat.len() != column.width() {
                let (n, width) = (flat.len(), column.width());
                found.say(format!("{STATS} has {n} numbers for {name} of {}, the column has {width} entries", column.name));
            }
        }
    }
}

fn flatten(value: &Value, found: &mut Vec<f64>) {
    match value {
        Value::Array(items) => items.iter().for_each(|item| flatten(item, found)),
        other => found.extend(other.as_f64()),
    }
}

/// The rows of all data files.
struct Scan<'a> {
    root: &'a Root,
    tasks: usize,
    found: &'a mut Problems,
    rows: usize,
    /// Kinds of problems that were told of columns, which are told once each.
    told: Vec<(String, &'static str)>,
}

impl Scan<'_> {
    fn all(&mut self, interrupt: &Interrupt) -> Result<()> {
        let names = self.root.data_files();
        for path in below(&self.root.path.join(DATA)).unwrap_or_default() {
            let name = path.strip_prefix(&self.root.path).unwrap_or(&path).display().to_string();
            if !names.contains(&name) {
                self.found.say(format!("{name} is in no episode of meta/episodes; LeRobot loads it all the same: remove it"));
            }
        }
        for name in names {
            interrupt.check()?;
            let path = self.root.path.join(&name);
            if !path.is_file() {
                self.found.say(format!("{name} is missing, but meta/episodes has episodes in it"));
                continue;
            }
            let scanned = self.file(&path, &name, interrupt);
            if matches!(scanned, Err(Error::Interrupted)) {
                return scanned;
            }
            self.found.take(&self.root.path, scanned);
        }
        if self.rows != self.root.info.frames {
            let (frames, rows) = (self.root.info.frames, self.rows);
            self.found.say(format!("meta/info.json says {frames} frames, the data files have {rows}"));
        }
        self.videos();
        Ok(())
    }

    /// What is in the rows is not in a file of its own.
    fn videos(&mut self) {
        for column in self.root.info.features.iter().filter(|column| column.dtype == "video") {
            if !self.root.path.join("videos").join(&column.name).is_dir() {
                self.found.say(format!("column {} is a video, but videos/{0} is missing", column.name));
            }
        }
    }

    fn file(&mut self, path: &Path, name: &str, interrupt: &Interrupt) -> Result<()> {
        let stream = Stream::open_any(path)?;
        let there: Vec<String> = stream.schema().fields().iter().map(|field| field.name().clone()).collect();
        for column in there.iter().filter(|column| self.root.info.feature(column).is_none()) {
            let what = format!("column {column} of {name} is not declared in meta/info.json: LeRobot does not load it");
            self.once(column, "undeclared", what);
        }
        for column in self.root.info.features.iter().filter(|column| column.dtype != "video" && !there.contains(&column.name)) {
            let what = format!("column {} is declared in meta/info.json, but {name} has none", column.name);
            self.once(&column.name, "missing", what);
        }
        let numeric = |column: &&Declared| column.kind().is_some() && there.contains(&column.name);
        let columns: Vec<Declared> = self.root.info.features.iter().filter(numeric).cloned().collect();
        let names: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
        for batch in stream.columns(path, &names)? {
            interrupt.check()?;
            let batch = batch?;
            columns.iter().for_each(|column| self.column(&batch, column));
            self.rows += batch.num_rows();
        }
        Ok(())
    }

    fn column(&mut self, batch: &RecordBatch, column: &Declared) {
        let (name, kind, array) = (&column.name, column.kind().unwrap_or(Kind::F64), &batch[column.name.as_str()]);
        let wide = if matches!(kind, Kind::F32) { Kind::F64 } else { kind };
        let mut cells = flat::none_of(wide);
        if let Err((row, what)) = flat::append(array, column.width(), &mut cells) {
            let row = row.map_or_else(String::new, |row| format!(", row {}", self.rows + row));
            return self.once(name, "shape", format!("column {name}{row}: {what}"));
        }
        let values = cells.to_f64();
        if let Some(at) = values.iter().position(|v| !v.is_finite()) {
            let (row, entry) = (self.rows + at / column.width(), at % column.width());
            let (value, more) = (values[at], values.iter().filter(|v| !v.is_finite()).count() - 1);
            self.once(
                name,
                "finite",
                format!(
                    "column {name}, row {row}, entry {entry}: {value} is not a finite number ({more} more in the rows around it)"
                ),
            );
        }
        self.place(column, &cells);
    }

    /// Columns that say where a row belongs, when and of which task it is.
    fn place(&mut self, column: &Declared, cells: &Cells) {
        let values = cells.to_f64();
        let (mut episode, mut first) = (0, 0);
        for (r, value) in values.iter().enumerate().take_while(|_| column.width() == 1) {
            let row = self.rows + r;
            while let Some(length) = self.root.episodes.get(episode).map(|e| e.length).filter(|length| row >= first + length) {
                (episode, first) = (episode + 1, first + length);
            }
            let frame = row - first;
            let expected = match column.name.as_str() {
                INDEX => row as f64,
                EPISODE => episode as f64,
                FRAME => frame as f64,
                TIMESTAMP => {
                    let time = frame as f64 / self.root.info.fps;
                    if (value - time).abs() <= TOLERANCE_S { *value } else { time }
                }
                TASK if *value < 0.0 || *value >= self.tasks.max(1) as f64 => {
                    let what = format!("column {TASK}, row {row}: {value} is none of the {} tasks in {TASKS}", self.tasks);
                    return self.once(TASK, "task", what);
                }
                _ => return,
            };
            if *value != expected {
                let name = &column.name;
                return self.once(
                    name,
                    "place",
                    format!("column {name}, row {row}: {value}, expected {expected} (by meta/episodes and fps)"),
                );
            }
        }
    }

    fn once(&mut self, column: &str, kind: &'static str, what: String) {
        if !self.told.iter().any(|(name, told)| name == column && *told == kind) {
            self.told.push((column.into(), kind));
            self.found.say(what);
        }
    }
}
