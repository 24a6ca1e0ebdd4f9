//! The `meta` folder: what the dataset is, its tasks, its episodes and their statistics.

use super::features::{Cells, EPISODE, Feature};
use super::stats::{NAMES, Stats, stats};
use crate::data::{Provenance, atomic, parquet_file, seal};
use crate::error::Result;
use crate::state::CONTROL_HZ;
use crate::tasks::Task;
use arrow_array::{ArrayRef, Float64Array, Int64Array, ListArray, RecordBatch, StringArray};
use arrow_buffer::OffsetBuffer;
use arrow_schema::{Field, Metadata, Schema};
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// The layout that LeRobot 0.6 reads.
pub(super) const CODEBASE_VERSION: &str = "v3.0";
pub(super) const INFO: &str = "meta/info.json";
pub(super) const STATS: &str = "meta/stats.json";
pub(super) const TASKS: &str = "meta/tasks.parquet";
pub(super) const EPISODES: &str = "meta/episodes/chunk-000/file-000.parquet";
/// Size at which a data file is closed \[MB\].
pub(super) const DATA_FILE_MB: usize = 100;
/// LeRobot's own number of files in a chunk folder.
const FILES_PER_CHUNK: usize = 1000;
/// LeRobot's own size at which a video file is closed \[MB\]; there are no videos.
const VIDEO_FILE_MB: usize = 200;
const DATA_PATH: &str = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet";
const ROBOT: &str = "kinova_j2n6s300";

/// The data file of an episode.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    chunk: usize,
    file: usize,
}

impl Place {
    /// Of the n-th data file.
    pub(super) fn of_file(number: usize) -> Self {
        Place { chunk: number / FILES_PER_CHUNK, file: number % FILES_PER_CHUNK }
    }

    /// Its path below the root.
    pub(super) fn data_path(self) -> String {
        format!("data/chunk-{:03}/file-{:03}.parquet", self.chunk, self.file)
    }
}

/// Whether a path below a dataset's root is one of a dataset.
pub(super) fn is_file(path: &Path) -> bool {
    let Some(name) = path.to_str() else { return false };
    let is_data = || {
        let (chunk, file) = name.strip_prefix("data/chunk-")?.split_once("/file-")?;
        let number = |text: &str| text.len() >= 3 && text.bytes().all(|b| b.is_ascii_digit());
        Some(number(chunk) && number(file.strip_suffix(".parquet")?))
    };
    [INFO, STATS, TASKS, EPISODES].contains(&name) || is_data().unwrap_or(false)
}

/// Writes a file below `dir` and notes its hash.
pub(super) fn put(dir: &Path, name: &str, bytes: &[u8], files: &mut BTreeMap<String, String>) -> Result<()> {
    files.insert(name.into(), blake3::hash(bytes).to_hex().to_string());
    atomic::write_new(&dir.join(name), bytes)
}

/// Writes the whole `meta` folder; `files` are the hashes of the data files.
pub(super) fn write(
    dir: &Path,
    task: Task,
    features: &[Feature],
    episodes: &[Vec<Cells>],
    places: &[Place],
    provenance: &Provenance,
    mut files: BTreeMap<String, String>,
) -> Result<()> {
    let lengths: Vec<usize> = episodes.iter().map(|cells| length(features, cells)).collect();
    let mut parquet = |name: &str, batch: std::result::Result<RecordBatch, arrow_schema::ArrowError>| {
        let cannot = |e: &dyn std::fmt::Display| parquet_file::cannot_encode(&dir.join(name), e);
        let bytes = parquet_file::of_batch(&batch.map_err(|e| cannot(&e))?, provenance).map_err(|e| cannot(&e))?;
        put(dir, name, &bytes, &mut files)
    };
    parquet(TASKS, task_table(task))?;
    parquet(EPISODES, episode_table(task, features, episodes, places, &lengths))?;
    put(dir, STATS, &pretty(&whole_stats(features, episodes)), &mut files)?;
    let info = Info {
        codebase_version: CODEBASE_VERSION,
        robot_type: ROBOT,
        total_episodes: episodes.len(),
        total_frames: lengths.iter().sum(),
        total_tasks: 1,
        chunks_size: FILES_PER_CHUNK,
        data_files_size_in_mb: DATA_FILE_MB,
        video_files_size_in_mb: VIDEO_FILE_MB,
        fps: CONTROL_HZ,
        splits: json!({ "train": format!("0:{}", episodes.len()) }),
        data_path: DATA_PATH,
        video_path: None,
        features: InOrder(features.iter().map(|f| (f.name.to_string(), describe(f))).collect()),
        hilt: json!({ "files": files, "provenance": provenance, "seal": seal::blank() }),
    };
    atomic::write_new(&dir.join(INFO), &seal::close(pretty(&info)))
}

/// `meta/info.json`.
#[derive(Serialize)]
struct Info {
    codebase_version: &'static str,
    robot_type: &'static str,
    total_episodes: usize,
    total_frames: usize,
    total_tasks: usize,
    chunks_size: usize,
    data_files_size_in_mb: usize,
    video_files_size_in_mb: usize,
    fps: u32,
    splits: Value,
    data_path: &'static str,
    video_path: Option<&'static str>,
    features: InOrder,
    hilt: Value,
}

/// A JSON object that keeps its order.
struct InOrder(Vec<(String, Value)>);

impl Serialize for InOrder {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        self.0.iter().try_for_each(|(key, value)| map.serialize_entry(key, value))?;
        map.end()
    }
}

fn describe(feature: &Feature) -> Value {
    json!({ "dtype": feature.kind.dtype(), "shape": [feature.width], "names": feature.names })
}

fn pretty(value: &impl Serialize) -> Vec<u8> {
    let mut text = serde_json::to_vec_pretty(value).expect("only string keys are written");
    text.push(b'\n');
    text
}

fn length(features: &[Feature], cells: &[Cells]) -> usize {
    let at = features.iter().position(|f| f.name == EPISODE).expect("every dataset has an episode column");
    cells[at].to_f64().len()
}

fn whole_stats(features: &[Feature], episodes: &[Vec<Cells>]) -> Map<String, Value> {
    let of = |i: usize, feature: &Feature| {
        let values: Vec<f64> = episodes.iter().flat_map(|cells| cells[i].to_f64()).collect();
        let Stats { rows, count } = stats(&values, feature.width);
        let mut entry: Map<String, Value> = NAMES.iter().zip(rows).map(|(name, row)| (name.to_string(), json!(row))).collect();
        entry.insert("count".into(), json!([count]));
        (feature.name.to_string(), Value::Object(entry))
    };
    features.iter().enumerate().map(|(i, feature)| of(i, feature)).collect()
}

/// `meta/tasks.parquet`. LeRobot looks tasks up in the pandas index, which pandas finds by this metadata of the Arrow schema.
fn task_table(task: Task) -> std::result::Result<RecordBatch, arrow_schema::ArrowError> {
    let column = |name: &str, pandas: &str, numpy: &str| json!({ "name": name, "field_name": name, "pandas_type": pandas, "numpy_type": numpy, "metadata": null });
    let index = json!({ "name": null, "field_name": null, "pandas_type": "unicode", "numpy_type": "object", "metadata": { "encoding": "UTF-8" } });
    let pandas = json!({
        "index_columns": ["task"],
        "column_indexes": [index],
        "columns": [column("task_index", "int64", "int64"), column("task", "unicode", "object")],
        "creator": { "library": "hilt", "version": env!("CARGO_PKG_VERSION") },
        "pandas_version": "2.2.3",
    });
    let columns = vec![
        ("task_index".to_string(), Arc::new(Int64Array::from(vec![0])) as ArrayRef),
        ("task".to_string(), Arc::new(StringArray::from(vec![task.instruction()]))),
    ];
    batch(columns, Metadata::new().with("pandas", pandas.to_string()))
}

/// `meta/episodes`: where each episode is, and its statistics.
fn episode_table(
    task: Task,
    features: &[Feature],
    episodes: &[Vec<Cells>],
    places: &[Place],
    lengths: &[usize],
) -> std::result::Result<RecordBatch, arrow_schema::ArrowError> {
    let int = |name: &str, values: Vec<usize>| {
        (name.to_string(), Arc::new(values.into_iter().map(|v| v as i64).collect::<Int64Array>()) as ArrayRef)
    };
    let ends: Vec<usize> = lengths
        .iter()
        .scan(0, |end, n| {
            *end += n;
            Some(*end)
        })
        .collect();
    let none = vec![0; episodes.len()];
    let tasks: ArrayRef = Arc::new(StringArray::from(vec![task.instruction(); episodes.len()]));
    let mut columns = vec![
        int("episode_index", (0..episodes.len()).collect()),
        ("tasks".to_string(), lists(1, tasks)),
        int("length", lengths.to_vec()),
        int("data/chunk_index", places.iter().map(|p| p.chunk).collect()),
        int("data/file_index", places.iter().map(|p| p.file).collect()),
        int("dataset_from_index", ends.iter().zip(lengths).map(|(end, n)| end - n).collect()),
        int("dataset_to_index", ends),
        int("meta/episodes/chunk_index", none.clone()),
        int("meta/episodes/file_index", none),
    ];
    for (i, feature) in features.iter().enumerate() {
        let found: Vec<Stats> = episodes.iter().map(|cells| stats(&cells[i].to_f64(), feature.width)).collect();
        for (row, name) in NAMES.iter().enumerate() {
            let values: ArrayRef =
                Arc::new(Float64Array::from_iter_values(found.iter().flat_map(|s| s.rows[row].iter().copied())));
            columns.push((format!("stats/{}/{name}", feature.name), lists(feature.width, values)));
        }
        let counts: ArrayRef = Arc::new(found.iter().map(|s| s.count as i64).collect::<Int64Array>());
        columns.push((format!("stats/{}/count", feature.name), lists(1, counts)));
    }
    batch(columns, Metadata::new())
}

/// A column of lists with `width` values each.
fn lists(width: usize, values: ArrayRef) -> ArrayRef {
    let item = Arc::new(Field::new_list_field(values.data_type().clone(), true));
    let offsets = OffsetBuffer::from_lengths(std::iter::repeat_n(width, values.len() / width));
    Arc::new(ListArray::new(item, offsets, values, None))
}

fn batch(columns: Vec<(String, ArrayRef)>, metadata: Metadata) -> std::result::Result<RecordBatch, arrow_schema::ArrowError> {
    let (fields, arrays): (Vec<Field>, Vec<ArrayRef>) =
        columns.into_iter().map(|(name, array)| (Field::new(name, array.data_type().clone(), false), array)).unzip();
    RecordBatch::try_new(Arc::new(Schema::new_with_metadata(fields, metadata)), arrays)
}
