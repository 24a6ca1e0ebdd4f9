//! `meta/episodes`: how long each episode is, and where its frames are.

use super::Info;
use super::flat;
use crate::data::dataset::cells::{Cells, Kind};
use crate::data::dataset::meta::EPISODES;
use crate::data::parquet_stream::Stream;
use crate::error::{Error, Result};
use arrow_array::cast::AsArray;
use arrow_array::{Array, ArrayRef, RecordBatch};
use std::path::{Path, PathBuf};

/// An episode, as the table has it.
#[derive(Clone, Debug, PartialEq)]
pub struct EpisodeRow {
    /// Its frames.
    pub length: usize,
    /// Number of its data file.
    pub chunk: usize,
    /// The same.
    pub file: usize,
    /// What it shows, in words.
    pub tasks: Vec<String>,
}

/// The columns that must be there, in the order of [`append`].
const NUMBERS: [&str; 4] = ["episode_index", "length", "data/chunk_index", "data/file_index"];
const TASKS: &str = "tasks";
/// A longer episode is a damaged file's.
const LONGEST: i64 = 1 << 40;

/// Paths of the table's files, in order: `chunk-*/file-*.parquet` below its folder.
pub(in crate::data::dataset) fn files(root: &Path) -> Result<Vec<PathBuf>> {
    below(&root.join(EPISODES))
}

/// `chunk-*/*.parquet` below a folder, in the order of their names, as LeRobot finds them.
pub(in crate::data::dataset) fn below(folder: &Path) -> Result<Vec<PathBuf>> {
    let list = |dir: &Path| -> Result<Vec<PathBuf>> {
        let unreadable = |e| Error::io(dir, "read", e);
        let entries = std::fs::read_dir(dir).map_err(unreadable)?.collect::<std::io::Result<Vec<_>>>().map_err(unreadable)?;
        let mut paths: Vec<PathBuf> = entries.into_iter().map(|entry| entry.path()).collect();
        paths.sort();
        Ok(paths)
    };
    let mut found = Vec::new();
    if folder.is_dir() {
        for chunk in list(folder)?.into_iter().filter(|path| path.is_dir()) {
            found.extend(list(&chunk)?.into_iter().filter(|path| path.extension().is_some_and(|ending| ending == "parquet")));
        }
    }
    Ok(found)
}

/// All episodes, checked against the description.
pub(super) fn read(root: &Path, info: &Info) -> Result<Vec<EpisodeRow>> {
    let files = files(root)?;
    if files.is_empty() {
        let message = format!(
            "has no {EPISODES}/chunk-000/file-000.parquet, which says how long each episode is; write one row an episode"
        );
        return Err(Error::input(root, message));
    }
    let mut rows = Vec::new();
    for path in files {
        let stream = Stream::open_any(&path)?;
        let wanted: Vec<&str> = NUMBERS.into_iter().chain([TASKS]).collect();
        for batch in stream.columns(&path, &wanted)? {
            append(&batch?, &mut rows).map_err(|why| Error::input(&path, why))?;
        }
    }
    let (episodes, frames) = (rows.len(), rows.iter().map(|row| row.length).sum::<usize>());
    if (episodes, frames) != (info.episodes, info.frames) || frames == 0 {
        let message = format!(
            "meta/info.json says {} episodes of {} frames, {EPISODES} has {episodes} of {frames}: mend the one that is wrong",
            info.episodes, info.frames
        );
        return Err(Error::input(root, message));
    }
    Ok(rows)
}

fn append(batch: &RecordBatch, rows: &mut Vec<EpisodeRow>) -> std::result::Result<(), String> {
    let mut numbers: [Cells; 4] = std::array::from_fn(|_| flat::none_of(Kind::I64));
    for (name, cells) in NUMBERS.iter().zip(&mut numbers) {
        let column = batch.column_by_name(name).ok_or_else(|| format!("has no column {name}"))?;
        flat::append(column, 1, cells).map_err(|(row, what)| match row {
            Some(row) => format!("column {name}, row {}: {what}", rows.len() + row),
            None => format!("column {name} {what}"),
        })?;
    }
    let [index, length, chunk, file] = numbers.map(|cells| match cells {
        Cells::I64(values) => values,
        _ => unreachable!("they were begun as whole numbers"),
    });
    for r in 0..batch.num_rows() {
        let number = rows.len();
        if index[r] != number as i64 {
            return Err(format!("episode_index of row {number} is {}: episodes are numbered from 0 without a gap", index[r]));
        }
        let whole = |name: &str, value: i64| {
            usize::try_from(value).map_err(|_| format!("episode {number} has {name} {value}; allowed: from 0"))
        };
        if !(1..=LONGEST).contains(&length[r]) {
            return Err(format!("episode {number} has length {}; allowed: from 1 to {LONGEST}", length[r]));
        }
        rows.push(EpisodeRow {
            length: whole("length", length[r])?,
            chunk: whole(NUMBERS[2], chunk[r])?,
            file: whole(NUMBERS[3], file[r])?,
            tasks: batch.column_by_name(TASKS).map_or_else(Vec::new, |column| texts(column, r)),
        });
    }
    Ok(())
}

/// The texts of a row, a list of them or one.
fn texts(column: &ArrayRef, row: usize) -> Vec<String> {
    let values = match column.data_type() {
        arrow_schema::DataType::List(_) => column.as_list::<i32>().value(row),
        arrow_schema::DataType::LargeList(_) => column.as_list::<i64>().value(row),
        arrow_schema::DataType::FixedSizeList(..) => column.as_fixed_size_list().value(row),
        _ => column.slice(row, 1),
    };
    text_values(&values)
}

/// The texts of a column; none of another kind.
pub(super) fn text_values(values: &ArrayRef) -> Vec<String> {
    let own = |text: Option<&str>| text.map(String::from);
    match values.data_type() {
        arrow_schema::DataType::Utf8 => values.as_string::<i32>().iter().filter_map(own).collect(),
        arrow_schema::DataType::LargeUtf8 => values.as_string::<i64>().iter().filter_map(own).collect(),
        arrow_schema::DataType::Utf8View => values.as_string_view().iter().filter_map(own).collect(),
        _ => Vec::new(),
    }
}
