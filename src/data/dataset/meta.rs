//! The `meta` folder but for its table of episodes: what the dataset is, its tasks, its statistics.

use super::features::Feature;
use super::files::{FILES_PER_CHUNK, is_of_series};
use super::stats::{NAMES, Stats};
use crate::data::{Provenance, atomic, parquet_file, seal};
use crate::error::Result;
use crate::layout::Layout;
use arrow_array::{ArrayRef, Int64Array, RecordBatch, StringArray};
use arrow_schema::{Field, Metadata, Schema};
use parquet::errors::ParquetError;
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// Folder of the training root.
pub const TRAIN: &str = "train";
/// Folder of the validation root.
pub const VALIDATION: &str = "validation";
/// The layout that LeRobot 0.6 reads.
pub(super) const CODEBASE_VERSION: &str = "v3.0";
pub(super) const INFO: &str = "meta/info.json";
pub(super) const STATS: &str = "meta/stats.json";
pub(super) const TASKS: &str = "meta/tasks.parquet";
/// Folders of the files that there may be several of.
pub(super) const DATA: &str = "data";
pub(super) const EPISODES: &str = "meta/episodes";
/// Size at which a file of either is closed \[MB\]: LeRobot's own.
pub(super) const DATA_FILE_MB: usize = 100;
/// LeRobot's own size at which a video file is closed \[MB\]; there are no videos.
const VIDEO_FILE_MB: usize = 200;
const DATA_PATH: &str = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet";
/// Key of what the rows hold.
pub(super) const LAYOUT: &str = "layout";

/// Whether a path below a dataset's root is one of a dataset.
pub(super) fn is_file(path: &Path) -> bool {
    let Some(name) = path.to_str() else { return false };
    [INFO, STATS, TASKS].contains(&name) || [DATA, EPISODES].iter().any(|folder| is_of_series(name, folder))
}

/// Writes a file below `dir` and notes its hash.
fn put(dir: &Path, name: &str, bytes: &[u8], files: &mut BTreeMap<String, String>) -> Result<()> {
    files.insert(name.into(), blake3::hash(bytes).to_hex().to_string());
    atomic::write_new(&dir.join(name), bytes)
}

/// What a dataset is, beside its columns.
pub(super) struct About {
    /// Who did it.
    pub(super) robot_type: Option<String>,
    /// Frames per second.
    pub(super) fps: f64,
    /// The instructions of its tasks, in the order of their numbers.
    pub(super) tasks: Vec<String>,
    /// What the rows of hilt's own hold.
    pub(super) layout: Option<Arc<Layout>>,
}

/// Writes what is known when all frames are written: of so many `episodes` and `frames`, with statistics over the `whole`, in `files`
/// with these hashes.
pub(super) fn write(
    dir: &Path,
    about: &About,
    features: &[Feature],
    (episodes, frames): (usize, usize),
    whole: &[Stats],
    provenance: &Provenance,
    files: impl IntoIterator<Item = (String, String)>,
) -> Result<()> {
    let mut files = files.into_iter().collect();
    let tasks = task_table(&about.tasks).map_err(ParquetError::from).and_then(|batch| parquet_file::of_batch(&batch, provenance));
    put(dir, TASKS, &tasks.map_err(|e| parquet_file::cannot_encode(&dir.join(TASKS), e))?, &mut files)?;
    put(dir, STATS, &pretty(&whole_stats(features, whole)), &mut files)?;
    let mut hilt = json!({ "files": files, "provenance": provenance, "seal": seal::blank() });
    if let Some(layout) = &about.layout {
        hilt[LAYOUT] = json!(**layout);
    }
    let info = Info {
        codebase_version: CODEBASE_VERSION,
        robot_type: about.robot_type.as_deref(),
        total_episodes: episodes,
        total_frames: frames,
        total_tasks: about.tasks.len(),
        chunks_size: FILES_PER_CHUNK,
        data_files_size_in_mb: DATA_FILE_MB,
        video_files_size_in_mb: VIDEO_FILE_MB,
        fps: if about.fps.fract() == 0.0 { json!(about.fps as u64) } else { json!(about.fps) },
        splits: json!({ "train": format!("0:{episodes}") }),
        data_path: DATA_PATH,
        video_path: None,
        features: InOrder(features.iter().map(|f| (f.name.to_string(), describe(f))).collect()),
        hilt,
    };
    atomic::write_new(&dir.join(INFO), &seal::close(pretty(&info)))
}

/// `meta/info.json`.
#[derive(Serialize)]
struct Info<'a> {
    codebase_version: &'static str,
    robot_type: Option<&'a str>,
    total_episodes: usize,
    total_frames: usize,
    total_tasks: usize,
    chunks_size: usize,
    data_files_size_in_mb: usize,
    video_files_size_in_mb: usize,
    fps: Value,
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

fn whole_stats(features: &[Feature], whole: &[Stats]) -> Map<String, Value> {
    let of = |(feature, stats): (&Feature, &Stats)| {
        let mut entry: Map<String, Value> =
            NAMES.iter().zip(&stats.rows).map(|(name, row)| (name.to_string(), json!(row))).collect();
        entry.insert("count".into(), json!([stats.count]));
        (feature.name.to_string(), Value::Object(entry))
    };
    features.iter().zip(whole).map(of).collect()
}

/// `meta/tasks.parquet`. LeRobot looks tasks up in the pandas index, which pandas finds by this metadata of the Arrow schema.
fn task_table(tasks: &[String]) -> std::result::Result<RecordBatch, arrow_schema::ArrowError> {
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
        ("task_index", Arc::new(Int64Array::from_iter_values(0..tasks.len() as i64)) as ArrayRef),
        ("task", Arc::new(StringArray::from_iter_values(tasks))),
    ];
    let fields: Vec<Field> = columns.iter().map(|(name, array)| Field::new(*name, array.data_type().clone(), false)).collect();
    let schema = Schema::new_with_metadata(fields, Metadata::new().with("pandas", pandas.to_string()));
    RecordBatch::try_new(Arc::new(schema), columns.into_iter().map(|(_, array)| array).collect())
}
