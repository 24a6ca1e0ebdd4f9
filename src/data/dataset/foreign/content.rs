//! What is in the files of a dataset, whoever wrote them: their hashes, and their columns.

use super::{INFO, Root, episodes};
use crate::data::ContentHash;
use crate::data::dataset::meta::{DATA, TASKS};
use crate::data::parquet_stream::Stream;
use crate::error::Result;
use std::path::PathBuf;

/// Names the content of all files that rows, episodes and tasks are read from.
pub(in crate::data::dataset) fn content(root: &Root) -> Result<ContentHash> {
    let mut paths: Vec<PathBuf> = episodes::files(&root.path)?;
    paths.extend(root.data_files().into_iter().map(|name| root.path.join(name)));
    paths.push(root.path.join(TASKS));
    let mut hashes = vec![(INFO.to_string(), root.info.hash)];
    for path in paths.iter().filter(|path| path.is_file()) {
        let name = path.strip_prefix(&root.path).unwrap_or(path).display().to_string();
        hashes.push((name, ContentHash::of_file(path)?));
    }
    Ok(ContentHash::of_directory(hashes.iter().map(|(name, hash)| (name.as_str(), *hash))))
}

/// The names of the columns, in the order of the first data file.
pub(in crate::data::dataset) fn column_order(root: &Root) -> Result<Vec<String>> {
    let path = root.path.join(root.data_files().first().map_or(DATA, String::as_str));
    let stream = Stream::open_any(&path)?;
    Ok(stream.schema().fields().iter().map(|field| field.name().clone()).collect())
}
