//! `meta/tasks.parquet`: what the episodes show, in words.

use super::episodes::text_values;
use super::flat;
use crate::data::dataset::cells::{Cells, Kind};
use crate::data::dataset::meta::TASKS;
use crate::data::parquet_stream::Stream;
use crate::error::{Error, Result};
use std::path::Path;

/// The columns: LeRobot keeps the words as the index of a data frame, which pandas calls `task` or, without a name, this.
const WORDS: [&str; 2] = ["task", "__index_level_0__"];
const NUMBER: &str = "task_index";

/// The instruction of each task, in the order of their numbers; none where the file is missing.
///
/// # Errors
/// [`Error::Input`] when it cannot be decoded, has a task without words, or numbers no task from 0 on.
pub fn instructions(root: &Path) -> Result<Vec<String>> {
    let path = root.join(TASKS);
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let stream = Stream::open_any(&path)?;
    let (mut words, mut numbers) = (Vec::new(), flat::none_of(Kind::I64));
    for batch in stream.columns(&path, &[WORDS[0], WORDS[1], NUMBER])? {
        let batch = batch?;
        let column = WORDS.iter().find_map(|name| batch.column_by_name(name));
        let column = column.ok_or_else(|| Error::input(&path, "has no column task"))?;
        let texts = text_values(column);
        if texts.len() != batch.num_rows() {
            let kind = column.data_type();
            return Err(Error::input(&path, format!("has a task without words, or words of another kind than text ({kind})")));
        }
        words.extend(texts);
        let column = batch.column_by_name(NUMBER).ok_or_else(|| Error::input(&path, format!("has no column {NUMBER}")))?;
        flat::append(column, 1, &mut numbers).map_err(|(_, why)| Error::input(&path, format!("column {NUMBER} {why}")))?;
    }
    let Cells::I64(numbers) = numbers else { return Ok(Vec::new()) };
    let mut order: Vec<(i64, String)> = numbers.into_iter().zip(words).collect();
    order.sort();
    if order.iter().enumerate().any(|(at, (number, _))| *number != at as i64) {
        return Err(Error::input(&path, "numbers its tasks otherwise than 0, 1, ... without a gap"));
    }
    Ok(order.into_iter().map(|(_, words)| words).collect())
}
