//! Frames that are read more than once while a dataset is written.

use super::cells::{Cells, Kind};
use crate::error::{Error, Result};
use std::fs::File;
use std::io::Write;
use std::os::unix::fs::FileExt;
use std::path::Path;

/// Columns as plain numbers, window by window, in a file without a name: the system removes it, however the process ends.
pub(super) struct Scratch<'a> {
    /// The directory that it is in, for errors.
    dir: &'a Path,
    file: File,
    /// Where each column of each window begins, and its length \[bytes\].
    windows: Vec<Vec<(u64, usize)>>,
    end: u64,
}

impl<'a> Scratch<'a> {
    /// An empty one in `dir`.
    pub(super) fn new(dir: &'a Path) -> Result<Self> {
        let file = tempfile::tempfile_in(dir).map_err(|e| Error::io(dir, "create", e))?;
        Ok(Scratch { dir, file, windows: Vec::new(), end: 0 })
    }

    /// Adds a window: the bytes of each column.
    pub(super) fn add(&mut self, columns: &[Vec<u8>]) -> Result<()> {
        let mut window = Vec::with_capacity(columns.len());
        for bytes in columns {
            self.file.write_all(bytes).map_err(|e| Error::io(self.dir, "write", e))?;
            window.push((self.end, bytes.len()));
            self.end += bytes.len() as u64;
        }
        self.windows.push(window);
        Ok(())
    }

    /// Shows the `i`-th column to `see`, window by window.
    pub(super) fn column(&self, i: usize, kind: Kind, mut see: impl FnMut(Cells) -> Result<()>) -> Result<()> {
        let mut bytes = Vec::new();
        self.windows.iter().try_for_each(|window| {
            let (from, len) = window[i];
            bytes.resize(len, 0);
            self.file.read_exact_at(&mut bytes, from).map_err(|e| Error::io(self.dir, "read", e))?;
            see(Cells::of_bytes(kind, &bytes))
        })
    }
}
