//! What is in the files of a dataset, whoever wrote them: their hashes, and their columns.

use super::{INFO, Root, episodes};
use crate::data::ContentHash;
use crate::data::dataset::meta::{DATA, TASKS};
use crate::data::parquet_stream::Stream;
use crate::error::{Error, Result};
use crate::interrupt;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Names the content of all files that rows, episodes and tasks are read from.
pub(in crate::data::dataset) fn content(root: &Root) -> Result<ContentHash> {
    let mut paths: Vec<PathBuf> = episodes::files(&root.path)?;
    paths.extend(root.data_files().into_iter().map(|name| root.path.join(name)));
    paths.push(root.path.join(TASKS));
    let mut hashes = vec![(INFO.to_string(), root.info.hash)];
    for path in paths.iter().filter(|path| path.is_file()) {
        let name = path.strip_prefix(&root.path).unwrap_or(path).display().to_string();
        hashes.push((name, hash(path)?));
    }
    Ok(ContentHash::of_directory(hashes.iter().map(|(name, hash)| (name.as_str(), *hash))))
}

fn hash(path: &Path) -> Result<ContentHash> {
    let mut hash = blake3::Hasher::new();
    let _waits = interrupt::waiting();
    File::open(path).and_then(|file| hash.update_reader(file).map(drop)).map_err(|e| Error::io(path, "read", e))?;
    Ok(ContentHash(hash.finalize()))
}

/// The names of the columns, in the order of the first data file.
pub(in crate::data::dataset) fn column_order(root: &Root) -> Result<Vec<String>> {
    let path = root.path.join(root.data_files().first().map_or(DATA, String::as_str));
    let stream = Stream::open_any(&path)?;
    Ok(stream.schema().fields().iter().map(|field| field.name().clone()).collect())
}
