//! Datasets written by hand with Arrow, as no program but this test writes them, and the commands over them.

use arrow_array::builder::{Float64Builder, ListBuilder};
use arrow_array::{ArrayRef, BooleanArray, Float64Array, Int32Array, Int64Array, RecordBatch, StringArray};
use hilt::math::sin_cos;
use parquet::arrow::ArrowWriter;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::Arc;

/// The binary under test.
pub const HILT: &str = env!("CARGO_BIN_EXE_hilt");

/// Settings of a run that takes a second.
pub const TINY: [&str; 14] = [
    "--set",
    "pretrain.epochs=3",
    "--set",
    "pretrain.hidden_units=16",
    "--set",
    "train.hidden_units=16",
    "--set",
    "train.warm_start_updates=60",
    "--set",
    "train.epochs=2",
    "--set",
    "train.min_updates=0",
    "--seed",
    "3",
];

/// A dataset as it is to be written; what is public can be spoilt.
pub struct Made {
    /// `meta/info.json`.
    pub info: Value,
    /// What `meta/episodes` says of them.
    pub said_lengths: Vec<usize>,
    /// Columns of a data file, in order.
    pub columns: Vec<(String, ArrayRef)>,
    /// Frames of a row group.
    pub group: usize,
}

/// A mass on a spring that is pushed about: position and velocity as lists of doubles, a scalar push, a third number that stays.
pub fn made(lengths: &[usize]) -> Made {
    let frames: usize = lengths.iter().sum();
    let (mut states, mut pushes) = (ListBuilder::new(Float64Builder::new()), Vec::new());
    let mut places: [Vec<i64>; 3] = Default::default();
    for (number, length) in lengths.iter().enumerate() {
        let (mut x, mut v) = (sin_cos(number as f64 * 1.7).0, 0.0);
        for t in 0..*length {
            let push = -1.5 * x - v + 0.1 * sin_cos(3.0 * (t + number) as f64).0;
            states.values().append_slice(&[x, v, 7000.0]);
            states.append(true);
            pushes.push(push);
            (v, x) = (v + 0.1 * push, x + 0.1 * (v + 0.1 * push));
            for (to, value) in places.iter_mut().zip([places_len(&pushes), number, t]) {
                to.push(value as i64);
            }
        }
    }
    let [index, episode, frame] = places;
    let times: Vec<f64> = frame.iter().map(|t| *t as f64 / 10.0).collect();
    let columns: Vec<(&str, ArrayRef)> = vec![
        ("observation.state", Arc::new(states.finish())),
        ("action", Arc::new(Float64Array::from(pushes))),
        ("note", Arc::new(StringArray::from(vec!["by hand"; frames]))),
        ("next.success", Arc::new(BooleanArray::from_iter(ends(lengths).map(Some)))),
        ("timestamp", Arc::new(Float64Array::from(times))),
        ("frame_index", Arc::new(Int32Array::from_iter_values(frame.iter().map(|v| *v as i32)))),
        ("episode_index", Arc::new(Int64Array::from(episode))),
        ("index", Arc::new(Int64Array::from(index))),
        ("task_index", Arc::new(Int64Array::from(vec![0; frames]))),
    ];
    let declare = |dtype: &str, n: usize, names: Value| json!({ "dtype": dtype, "shape": [n], "names": names });
    let scalar = |dtype| declare(dtype, 1, Value::Null);
    let info = json!({
        "codebase_version": "v3.0", "robot_type": "spring", "fps": 10, "splits": {},
        "total_episodes": lengths.len(), "total_frames": frames, "total_tasks": 1, "chunks_size": 1000,
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet", "video_path": null,
        "features": {
            "observation.state": declare("float64", 3, json!(["x", "v", "k"])), "action": scalar("float64"), "note": scalar("string"),
            "next.success": scalar("bool"), "timestamp": scalar("float64"), "frame_index": scalar("int32"),
            "episode_index": scalar("int64"), "index": scalar("int64"), "task_index": scalar("int64"),
        },
    });
    let columns = columns.into_iter().map(|(name, array)| (name.to_string(), array)).collect();
    Made { info, said_lengths: lengths.into(), columns, group: 7 }
}

fn places_len(pushes: &[f64]) -> usize {
    pushes.len() - 1
}

/// Every other episode succeeds at its end.
fn ends(lengths: &[usize]) -> impl Iterator<Item = bool> {
    let ends =
        lengths.iter().enumerate().flat_map(|(number, length)| (0..*length).map(move |t| number % 2 == 0 && t + 1 == *length));
    ends.collect::<Vec<_>>().into_iter()
}

impl Made {
    /// A column, to be spoilt.
    pub fn column(&mut self, name: &str) -> &mut ArrayRef {
        &mut self.columns.iter_mut().find(|(found, _)| found == name).expect("a column").1
    }

    /// Removes a column from the rows and from the description.
    pub fn without(mut self, name: &str) -> Self {
        self.columns.retain(|(found, _)| found != name);
        self.info["features"].as_object_mut().expect("features").remove(name);
        self
    }

    /// Writes it.
    pub fn write(&self, root: &Path) {
        table(&root.join("data/chunk-000/file-000.parquet"), &self.columns, self.group);
        let n = self.said_lengths.len();
        let ints = |values: Vec<usize>| Arc::new(Int64Array::from_iter_values(values.into_iter().map(|v| v as i64))) as ArrayRef;
        let columns = [
            ("episode_index", ints((0..n).collect())),
            ("length", ints(self.said_lengths.clone())),
            ("data/chunk_index", ints(vec![0; n])),
            ("data/file_index", ints(vec![0; n])),
            ("tasks", Arc::new(StringArray::from(vec!["hold still"; n])) as ArrayRef),
        ];
        let columns: Vec<_> = columns.into_iter().map(|(name, array)| (name.to_string(), array)).collect();
        table(&root.join("meta/episodes/chunk-000/file-000.parquet"), &columns, 100);
        let tasks = [("task_index", ints(vec![0])), ("task", Arc::new(StringArray::from(vec!["hold still"])) as ArrayRef)];
        let tasks: Vec<_> = tasks.into_iter().map(|(name, array)| (name.to_string(), array)).collect();
        table(&root.join("meta/tasks.parquet"), &tasks, 100);
        fs::write(root.join("meta/info.json"), self.info.to_string()).expect("written");
    }
}

/// Writes a table, `group` rows to a row group.
pub fn table(path: &Path, columns: &[(String, ArrayRef)], group: usize) {
    fs::create_dir_all(path.parent().expect("a parent")).expect("made");
    let batch = RecordBatch::try_from_iter(columns.iter().map(|(name, array)| (name, Arc::clone(array)))).expect("columns");
    let mut writer = ArrowWriter::try_new(fs::File::create(path).expect("a file"), batch.schema(), None).expect("a writer");
    for from in (0..batch.num_rows()).step_by(group) {
        writer.write(&batch.slice(from, group.min(batch.num_rows() - from))).expect("written");
        writer.flush().expect("written");
    }
    writer.close().expect("closed");
}

/// Runs hilt in a directory.
pub fn hilt(dir: &Path, words: &[&str]) -> Output {
    Command::new(HILT).current_dir(dir).args(words).output().expect("the binary runs")
}

/// The words of a run that succeeds: its stdout and stderr.
pub fn done(dir: &Path, words: &[&str]) -> (String, String) {
    let output = hilt(dir, words);
    let [out, err] = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    assert_eq!(output.status.code(), Some(0), "{words:?}: {err}");
    (out, err)
}

/// The error of a run that fails with this code.
pub fn refused(dir: &Path, words: &[&str], code: i32) -> String {
    let output = hilt(dir, words);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{words:?}: {said}");
    assert_eq!(said.lines().filter(|line| line.starts_with("error: ")).count(), 1, "{said}");
    said
}

/// The bytes of every file below a directory.
pub fn contents(dir: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let (mut found, mut open) = (BTreeMap::new(), vec![dir.to_path_buf()]);
    while let Some(dir) = open.pop() {
        for entry in fs::read_dir(&dir).expect("readable") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                open.push(path);
            } else {
                found.insert(path.clone(), fs::read(&path).expect("readable"));
            }
        }
    }
    found
}

/// A fixture.
pub fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/foreign").join(name)
}
