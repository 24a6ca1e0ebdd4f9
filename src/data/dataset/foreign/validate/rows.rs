//! The rows against the description, all of them.

use super::problems::Problems;
use crate::data::dataset::cells::{Cells, Kind};
use crate::data::dataset::features::{EPISODE, FRAME, INDEX, TASK, TIMESTAMP};
use crate::data::dataset::foreign::description::Declared;
use crate::data::dataset::foreign::episodes::below;
use crate::data::dataset::foreign::{Root, flat};
use crate::data::dataset::meta::{DATA, TASKS};
use crate::data::parquet_stream::Stream;
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use arrow_array::RecordBatch;
use std::path::Path;

/// How far a timestamp may be from frame_index / fps \[s\]: LeRobot's own tolerance.
const TOLERANCE_S: f64 = 1e-4;
/// The rows of all data files.
pub(super) struct Scan<'a> {
    root: &'a Root,
    tasks: usize,
    found: &'a mut Problems,
    rows: usize,
    /// Kinds of problems that were told of columns, which are told once each.
    told: Vec<(String, &'static str)>,
}

impl<'a> Scan<'a> {
    /// Of a dataset with so many tasks.
    pub(super) fn new(root: &'a Root, tasks: usize, found: &'a mut Problems) -> Self {
        Scan { root, tasks, found, rows: 0, told: Vec::new() }
    }

    /// Looks at all files.
    ///
    /// # Errors
    /// [`Error::Interrupted`].
    pub(super) fn all(&mut self, interrupt: &Interrupt) -> Result<()> {
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
        if let Some(at) = values.iter().position(|v| kind == Kind::F32 && v.is_finite() && v.abs() > f64::from(f32::MAX)) {
            let (row, value) = (self.rows + at / column.width(), values[at]);
            self.once(name, "single", format!("column {name}, row {row}: {value:e} is more than float32 holds"));
        }
        self.place(column, &cells);
    }

    /// Columns that say where a row belongs, when and of which task it is.
    fn place(&mut self, column: &Declared, cells: &Cells) {
        if column.width() != 1 || ![INDEX, EPISODE, FRAME, TIMESTAMP, TASK].contains(&column.name.as_str()) {
            return;
        }
        let values = cells.to_f64();
        let (mut episode, mut first) = (0, 0);
        for (r, value) in values.iter().enumerate() {
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
                _ => *value,
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
