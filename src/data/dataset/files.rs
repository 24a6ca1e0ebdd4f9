//! The Parquet files of a dataset, written to the disk as they grow: row groups are encoded on any thread and appended in their order, so
//! no more than a window of them is in memory, and the bytes are the same for any number of threads.

use crate::data::{Provenance, parquet_file, seal};
use crate::error::{Error, Result};
use arrow_array::{ArrayRef, RecordBatch};
use arrow_schema::{Schema, SchemaRef};
use parquet::arrow::arrow_writer::{ArrowColumnChunk, ArrowRowGroupWriterFactory, compute_leaves};
use parquet::errors::ParquetError;
use parquet::file::writer::SerializedFileWriter;
use rayon::prelude::*;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// LeRobot's own number of files in a chunk folder.
pub(super) const FILES_PER_CHUNK: usize = 1000;

/// A file of a numbered series.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub(super) chunk: usize,
    pub(super) file: usize,
}

impl Place {
    /// The first file.
    pub(super) const FIRST: Place = Place { chunk: 0, file: 0 };

    fn of_file(number: usize) -> Self {
        Place { chunk: number / FILES_PER_CHUNK, file: number % FILES_PER_CHUNK }
    }

    /// Its path below the root.
    fn path(self, folder: &str) -> String {
        format!("{folder}/chunk-{:03}/file-{:03}.parquet", self.chunk, self.file)
    }
}

/// Whether `name` is one of a series below `folder`.
pub(super) fn is_of_series(name: &str, folder: &str) -> bool {
    let numbers = || {
        let (chunk, file) = name.strip_prefix(folder)?.strip_prefix("/chunk-")?.split_once("/file-")?;
        let number = |text: &str| text.len() >= 3 && text.bytes().all(|b| b.is_ascii_digit());
        Some(number(chunk) && number(file.strip_suffix(".parquet")?))
    };
    numbers().unwrap_or(false)
}

/// A row group, encoded.
pub(super) type RowGroup = Vec<ArrowColumnChunk>;

/// Encodes row groups.
pub(super) struct Encoder {
    schema: SchemaRef,
    factory: ArrowRowGroupWriterFactory,
}

impl Encoder {
    /// For files of `schema`.
    pub(super) fn new(schema: Schema, provenance: &Provenance) -> std::result::Result<Self, ParquetError> {
        let (_, factory) = parquet_file::Writer::new(&schema, provenance)?.into_parts()?;
        Ok(Encoder { schema: Arc::new(schema), factory })
    }

    /// A row group of these columns.
    pub(super) fn encode(&self, columns: Vec<ArrayRef>) -> std::result::Result<RowGroup, ParquetError> {
        let batch = RecordBatch::try_new(Arc::clone(&self.schema), columns)?;
        let fields = self.schema.fields().iter().zip(batch.columns());
        let leaves = fields.map(|(field, column)| compute_leaves(field, column)).collect::<std::result::Result<Vec<_>, _>>()?;
        let leaves: Vec<_> = leaves.into_iter().flatten().collect();
        let columns = self.factory.create_column_writers(0)?.into_par_iter().zip(leaves);
        columns
            .map(|(mut writer, leaf)| {
                writer.write(&leaf)?;
                writer.close()
            })
            .collect()
    }
}

/// A series of files, each closed once it is big enough.
pub(super) struct Series<'a> {
    dir: &'a Path,
    /// Below `dir`.
    folder: &'static str,
    schema: SchemaRef,
    provenance: &'a Provenance,
    /// A file is closed once it is this big.
    file_bytes: usize,
    open: Option<Open>,
    /// The closed files and the hashes of their content, in order.
    closed: Vec<(String, String)>,
}

/// The file that grows.
struct Open {
    path: PathBuf,
    file: File,
    /// Holds what is not yet in the file.
    writer: SerializedFileWriter<Vec<u8>>,
    /// Of what is.
    hash: blake3::Hasher,
}

impl<'a> Series<'a> {
    /// Files of what `encoder` makes, `folder/chunk-000/file-000.parquet` and so on below `dir`.
    pub(super) fn new(
        dir: &'a Path,
        folder: &'static str,
        encoder: &Encoder,
        provenance: &'a Provenance,
        file_bytes: usize,
    ) -> Self {
        Series { dir, folder, schema: Arc::clone(&encoder.schema), provenance, file_bytes, open: None, closed: Vec::new() }
    }

    /// Where the next row group goes.
    pub(super) fn place(&self) -> Place {
        Place::of_file(self.closed.len())
    }

    /// An error in what hilt itself makes, speaking of the file that is written.
    pub(super) fn cannot_encode(&self, error: impl std::fmt::Display) -> Error {
        parquet_file::cannot_encode(&self.dir.join(self.place().path(self.folder)), error)
    }

    /// Adds a row group.
    pub(super) fn append(&mut self, group: RowGroup) -> Result<()> {
        let mut open = match self.open.take() {
            Some(open) => open,
            None => self.begin()?,
        };
        open.append(group).map_err(|e| self.cannot_encode(e))?;
        open.flush()?;
        if open.writer.bytes_written() >= self.file_bytes {
            return self.close(open);
        }
        self.open = Some(open);
        Ok(())
    }

    /// The paths below the root and the hashes of all files, in their order.
    pub(super) fn finish(mut self) -> Result<Vec<(String, String)>> {
        if let Some(open) = self.open.take() {
            self.close(open)?;
        }
        Ok(self.closed)
    }

    fn begin(&self) -> Result<Open> {
        let path = self.dir.join(self.place().path(self.folder));
        let writer = parquet_file::Writer::new(&self.schema, self.provenance).and_then(parquet_file::Writer::into_parts);
        let (writer, _) = writer.map_err(|e| self.cannot_encode(e))?;
        let parent = path.parent().unwrap_or(self.dir);
        fs::create_dir_all(parent).map_err(|e| Error::io(parent, "create", e))?;
        let file = File::create_new(&path).map_err(|e| Error::io(&path, "create", e))?;
        Ok(Open { path, file, writer, hash: blake3::Hasher::new() })
    }

    fn close(&mut self, open: Open) -> Result<()> {
        let Open { path, mut file, writer, hash } = open;
        let end = writer.into_inner().map_err(|e| self.cannot_encode(e))?;
        let (end, hash) = seal::close_end(&hash, end);
        file.write_all(&end).and_then(|()| file.sync_all()).map_err(|e| Error::io(&path, "write", e))?;
        self.closed.push((self.place().path(self.folder), hash.to_hex().to_string()));
        Ok(())
    }
}

impl Open {
    fn append(&mut self, group: RowGroup) -> std::result::Result<(), ParquetError> {
        let mut writer = self.writer.next_row_group()?;
        group.into_iter().try_for_each(|chunk| chunk.append_to_row_group(&mut writer))?;
        writer.close()?;
        Ok(self.writer.flush()?)
    }

    /// What the writer holds goes to the disk.
    fn flush(&mut self) -> Result<()> {
        let bytes = self.writer.inner_mut();
        self.hash.update(bytes);
        self.file.write_all(bytes).map_err(|e| Error::io(&self.path, "write", e))?;
        bytes.clear();
        Ok(())
    }
}
