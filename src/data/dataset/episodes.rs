//! `meta/episodes`: where each episode is, and its statistics.

use super::features::Feature;
use super::files::{Encoder, Place, Series};
use super::meta::EPISODES;
use super::sizes::Sizes;
use super::stats::{NAMES, Stats};
use crate::data::{Provenance, parquet_file};
use crate::error::Result;
use arrow_array::{Array, ArrayRef, Float64Array, Int64Array, ListArray, StringArray};
use arrow_buffer::OffsetBuffer;
use arrow_schema::{Field, Schema};
use std::path::Path;
use std::sync::Arc;

/// An episode of the table.
pub(super) struct Row {
    /// Its number of frames.
    pub(super) length: usize,
    /// What it shows, in words.
    pub(super) tasks: Vec<String>,
    /// Of each feature.
    pub(super) stats: Vec<Stats>,
}

/// The table as it is written.
pub(super) struct EpisodeTable<'a> {
    features: &'a [Feature],
    encoder: Encoder,
    files: Series<'a>,
    /// Rows of a row group.
    rows_at_once: usize,
    /// Rows that wait for their row group, with the places of their data.
    waiting: Vec<(Place, Row)>,
    /// Episodes and frames of the row groups.
    episodes: usize,
    frames: usize,
}

impl<'a> EpisodeTable<'a> {
    /// An empty one below `dir`.
    pub(super) fn new(dir: &'a Path, features: &'a [Feature], provenance: &'a Provenance, sizes: Sizes) -> Result<Self> {
        let fields = columns(features, &[], (0, 0), Place::FIRST);
        let fields: Vec<Field> = fields.iter().map(|(name, array)| Field::new(name, array.data_type().clone(), false)).collect();
        let encoder = Encoder::new(Schema::new(fields), provenance).map_err(|e| parquet_file::cannot_encode(dir, e))?;
        let files = Series::new(dir, EPISODES, &encoder, provenance, sizes.file_bytes);
        Ok(EpisodeTable { features, encoder, files, rows_at_once: sizes.table_rows, waiting: Vec::new(), episodes: 0, frames: 0 })
    }

    /// Adds an episode, whose frames are in the data file at `place`.
    pub(super) fn append(&mut self, place: Place, row: Row) -> Result<()> {
        self.waiting.push((place, row));
        if self.waiting.len() >= self.rows_at_once { self.flush() } else { Ok(()) }
    }

    /// The paths below the root and the hashes of all files.
    pub(super) fn finish(mut self) -> Result<Vec<(String, String)>> {
        if !self.waiting.is_empty() {
            self.flush()?;
        }
        self.files.finish()
    }

    fn flush(&mut self) -> Result<()> {
        let rows = std::mem::take(&mut self.waiting);
        let columns = columns(self.features, &rows, (self.episodes, self.frames), self.files.place());
        let group = self.encoder.encode(columns.into_iter().map(|(_, array)| array).collect());
        self.files.append(group.map_err(|e| self.files.cannot_encode(e))?)?;
        self.episodes += rows.len();
        self.frames += rows.iter().map(|(_, row)| row.length).sum::<usize>();
        Ok(())
    }
}

/// The columns of a row group, after so many `episodes` and `frames` in others; it goes into the file at `here`.
fn columns(
    features: &[Feature],
    rows: &[(Place, Row)],
    (episodes, frames): (usize, usize),
    here: Place,
) -> Vec<(String, ArrayRef)> {
    let int = |name: &str, value: &dyn Fn(usize, &(Place, Row)) -> usize| {
        let values = rows.iter().enumerate().map(|(i, row)| value(i, row) as i64);
        (name.to_string(), Arc::new(values.collect::<Int64Array>()) as ArrayRef)
    };
    let tasks: ArrayRef = Arc::new(StringArray::from_iter_values(rows.iter().flat_map(|(_, row)| &row.tasks)));
    let tasks = lists_of(rows.iter().map(|(_, row)| row.tasks.len()), tasks);
    let mut frame = frames;
    let ends: Vec<usize> = rows
        .iter()
        .map(|(_, row)| {
            frame += row.length;
            frame
        })
        .collect();
    let mut columns = vec![
        int("episode_index", &|i, _| episodes + i),
        ("tasks".to_string(), tasks),
        int("length", &|_, (_, row)| row.length),
        int("data/chunk_index", &|_, (place, _)| place.chunk),
        int("data/file_index", &|_, (place, _)| place.file),
        int("dataset_from_index", &|i, (_, row)| ends[i] - row.length),
        int("dataset_to_index", &|i, _| ends[i]),
        int("meta/episodes/chunk_index", &|_, _| here.chunk),
        int("meta/episodes/file_index", &|_, _| here.file),
    ];
    for (i, feature) in features.iter().enumerate() {
        let found = || rows.iter().map(|(_, row)| &row.stats[i]);
        for (row, name) in NAMES.iter().enumerate() {
            let values: ArrayRef = Arc::new(Float64Array::from_iter_values(found().flat_map(|s| s.rows[row].iter().copied())));
            columns.push((format!("stats/{}/{name}", feature.name), lists(feature.width, values)));
        }
        let counts: ArrayRef = Arc::new(found().map(|s| s.count as i64).collect::<Int64Array>());
        columns.push((format!("stats/{}/count", feature.name), lists(1, counts)));
    }
    columns
}

/// A column of lists with `width` values each.
fn lists(width: usize, values: ArrayRef) -> ArrayRef {
    lists_of(std::iter::repeat_n(width, values.len() / width), values)
}

/// A column of lists of these lengths.
fn lists_of(lengths: impl Iterator<Item = usize>, values: ArrayRef) -> ArrayRef {
    let item = Arc::new(Field::new_list_field(values.data_type().clone(), true));
    let offsets = OffsetBuffer::from_lengths(lengths.collect::<Vec<_>>());
    Arc::new(ListArray::new(item, offsets, values, None))
}
