//! What an artefact on the disk is: its provenance, and the hash that a later stage's provenance calls it by. Enough to tell whether a step has
//! been done; numbers are not decoded.

use super::{ContentHash, Provenance, dataset, json_file, recording, table_file, weights};
use crate::error::{Error, Result};
use rayon::prelude::*;
use std::fs::DirEntry;
use std::path::{Path, PathBuf};

/// A kind of artefact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A table.
    Table,
    /// A directory of recordings.
    Recordings,
    /// A directory with the datasets train and validation.
    Datasets,
    /// Weights of this kind.
    Weights(&'static str),
    /// A summary.
    Summary,
}

/// Provenance and content of the artefact at `path`. Of recordings the first tells the provenance, for all come from one run.
///
/// # Errors
/// [`Error::Input`] when it is missing, damaged or another kind of artefact; [`Error::Io`] when it cannot be read.
pub fn origin(path: &Path, kind: Kind) -> Result<(Provenance, ContentHash)> {
    match kind {
        Kind::Table => table_file::Reader::open(path).map(|table| (table.provenance().clone(), table.content())),
        Kind::Weights(kind) => weights::read_hashed(path, kind).map(|(.., provenance, content)| (provenance, content)),
        Kind::Summary => json_file::read_hashed(path).map(|(_, provenance, content)| (provenance, content)),
        Kind::Recordings => {
            let files = recording::files(path)?;
            let first = files.first().ok_or_else(|| Error::input(path, "holds no recording; run hilt simulate again"))?;
            let (_, provenance) = recording::read(first)?;
            Ok((provenance, content_of(path, &files)?))
        }
        Kind::Datasets => {
            let provenance = dataset::provenance(&path.join(dataset::TRAIN))?;
            let mut files = Vec::new();
            for part in [dataset::TRAIN, dataset::VALIDATION] {
                files_below(&path.join(part), &mut files).map_err(|e| Error::io(path, "read", e))?;
            }
            let own = |file: &PathBuf| file.strip_prefix(path).is_ok_and(dataset::is_file);
            files.retain(own);
            Ok((provenance, content_of(path, &files)?))
        }
    }
}

/// The provenance alone, for which little is read.
///
/// # Errors
/// As [`origin`].
pub fn provenance(path: &Path, kind: Kind) -> Result<Provenance> {
    match kind {
        Kind::Table => table_file::Reader::open(path).map(|table| table.provenance().clone()),
        Kind::Recordings => {
            let files = recording::files(path)?;
            let first = files.first().ok_or_else(|| Error::input(path, "holds no recording; run hilt simulate first"))?;
            recording::read(first).map(|(_, provenance)| provenance)
        }
        Kind::Datasets => dataset::provenance(&path.join(dataset::TRAIN)),
        Kind::Weights(_) | Kind::Summary => origin(path, kind).map(|(provenance, _)| provenance),
    }
}

/// The content of these files below a directory.
fn content_of(root: &Path, files: &[PathBuf]) -> Result<ContentHash> {
    let hash = |file: &PathBuf| {
        let name = file.strip_prefix(root).unwrap_or(file).to_string_lossy().into_owned();
        Ok((name, ContentHash::of_file(file)?))
    };
    let hashes = files.par_iter().map(hash).collect::<Result<Vec<_>>>()?;
    Ok(ContentHash::of_directory(hashes.iter().map(|(name, hash)| (name.as_str(), *hash))))
}

/// Bytes of a file, or of all files below a directory, links to directories aside; what cannot be read has none.
pub fn bytes_of(path: &Path) -> u64 {
    let Ok(entries) = std::fs::read_dir(path) else { return std::fs::metadata(path).map_or(0, |found| found.len()) };
    let leads_away = |entry: &DirEntry| entry.file_type().is_ok_and(|kind| kind.is_symlink()) && entry.path().is_dir();
    entries.flatten().filter(|entry| !leads_away(entry)).map(|entry| bytes_of(&entry.path())).sum()
}

fn files_below(dir: &Path, found: &mut Vec<PathBuf>) -> std::io::Result<()> {
    if !dir.exists() {
        return Ok(());
    }
    for entry in std::fs::read_dir(dir)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() { files_below(&entry.path(), found)? } else { found.push(entry.path()) }
    }
    Ok(())
}
