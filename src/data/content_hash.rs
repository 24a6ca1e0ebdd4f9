//! What names the content of files.

use crate::error::{Error, Result};
use crate::interrupt;
use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::path::Path;

/// What names bytes, wherever they are: their BLAKE3 hash, hexadecimal as text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ContentHash(pub(super) blake3::Hash);

impl ContentHash {
    /// Of the bytes of a file.
    pub fn of(bytes: &[u8]) -> Self {
        ContentHash(blake3::hash(bytes))
    }

    /// Of the bytes of a file, a part in memory at a time; an interrupt is heard while it waits.
    ///
    /// # Errors
    /// [`Error::Io`] when it cannot be read.
    pub fn of_file(path: &Path) -> Result<Self> {
        let mut hash = blake3::Hasher::new();
        let _waits = interrupt::waiting();
        File::open(path).and_then(|file| hash.update_reader(file).map(drop)).map_err(|e| Error::io(path, "read", e))?;
        Ok(ContentHash(hash.finalize()))
    }

    /// Of a directory: its files' names, relative to it and sorted, each with the hash of its content.
    pub fn of_directory<'a>(files: impl IntoIterator<Item = (&'a str, ContentHash)>) -> Self {
        let files: BTreeMap<&str, ContentHash> = files.into_iter().collect();
        let mut hash = blake3::Hasher::new();
        for (name, content) in files {
            hash.update(&(name.len() as u64).to_le_bytes()).update(name.as_bytes());
            hash.update(content.0.as_bytes());
        }
        ContentHash(hash.finalize())
    }
}

impl fmt::Display for ContentHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.0.to_hex().as_str())
    }
}
