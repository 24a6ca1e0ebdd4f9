//! What a dataset says of itself, for people and programs.

use super::{Declared, Root, instructions};
use crate::data::origin::bytes_of;
use crate::error::Result;
use serde_json::{Value, json};

/// Episodes, frames, rate, columns, tasks and sizes of a dataset, whoever wrote it.
///
/// # Errors
/// [`crate::error::Error::Input`] when `meta/tasks.parquet` cannot be read; [`crate::error::Error::Io`].
pub fn described(root: &Root) -> Result<Value> {
    let info = &root.info;
    let column = |column: &Declared| {
        let names = column.names.as_ref().map(|names| names.join(" "));
        json!({ "name": column.name, "type": column.dtype, "shape": column.shape, "names": names })
    };
    let lengths = || root.episodes.iter().map(|episode| episode.length);
    Ok(json!({
        "episodes": info.episodes,
        "frames": info.frames,
        "fps": info.fps,
        "shortest_episode": lengths().min(),
        "longest_episode": lengths().max(),
        "duration_s": info.frames as f64 / info.fps,
        "robot_type": info.robot_type,
        "columns": info.features.iter().map(column).collect::<Vec<_>>(),
        "tasks": instructions(&root.path)?,
        "bytes": bytes_of(&root.path),
    }))
}
