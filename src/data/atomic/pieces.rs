//! Very many files of a directory that grows, each of which appears whole.

use super::{finish, temporary};
use crate::error::{Error, Result};
use std::fs;
use std::path::Path;

/// Writes one file of very many into a directory that is there: as [`write_bytes`], but the directory is looked at neither before nor after.
///
/// # Errors
/// [`Error::Io`] when the system refuses.
pub fn write_piece(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut file = temporary::file(path.parent().unwrap_or(Path::new(".")), path)?;
    finish(path, &mut file, bytes)?;
    file.persist(path).map(drop).map_err(|e| Error::io(path, "rename", e.error))
}

/// Gives a file a second name, or copies it where the file system has no such names or another begins.
///
/// # Errors
/// [`Error::Io`] when the system refuses.
pub fn link(from: &Path, to: &Path) -> Result<()> {
    fs::hard_link(from, to).or_else(|_| fs::copy(from, to).map(drop)).map_err(|e| Error::io(from, "read", e))
}

/// Makes a directory, with those above it, in which many files will be written; what killed processes left of such files is removed.
///
/// # Errors
/// [`Error::Io`] when the system refuses.
pub fn make_dir(path: &Path) -> Result<()> {
    fs::create_dir_all(path).map_err(|e| Error::io(path, "create", e))?;
    temporary::sweep(path);
    Ok(())
}
