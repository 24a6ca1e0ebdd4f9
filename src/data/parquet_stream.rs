//! A Parquet file of hilt that is longer than the memory.

use super::bytes::Ends;
use super::parquet_file::{
    BROKEN, LONG, MOST_PART_BYTES, WRITER_WITHIN, cannot_decode, ends_as_foreign, foreign, rows_at_once, tail_bytes,
};
use super::{ContentHash, parquet_limits, seal};
use crate::error::{Error, Result};
use crate::guard::guarded;
use crate::interrupt;
use arrow_array::RecordBatch;
use arrow_schema::{ArrowError, SchemaRef};
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReaderBuilder};
use std::borrow::Cow;
use std::fs::File;
use std::io::Seek;
use std::os::unix::fs::FileExt;
use std::path::Path;

/// A Parquet file on the disk, checked and then decoded batch by batch.
pub(super) struct Stream {
    file: File,
    metadata: ArrowReaderMetadata,
    rows: usize,
    /// The hash of all its bytes.
    pub(super) content: ContentHash,
}

impl Stream {
    /// Checks the seal and what the file says of its own size.
    ///
    /// # Errors
    /// As [`open`].
    pub(super) fn open(path: &Path) -> Result<Self> {
        let (file, len) = LONG.open(path)?;
        if ends_as_foreign(&Ends::OfFile(&file, len).tail(path, WRITER_WITHIN)?) {
            return Err(foreign(path));
        }
        let waits = interrupt::waiting();
        let tail = tail_bytes(&file).map_err(|e| Error::io(path, "read", e))?;
        let content = seal::check_file(path, &file, tail)?;
        drop(waits);
        Stream::of(path, file, len, content, parquet_limits::OWN)
    }

    /// A file of whatever program: checks what it says of its own size.
    ///
    /// # Errors
    /// As [`open`], but for the seal.
    pub(super) fn open_any(path: &Path) -> Result<Self> {
        let (file, len) = LONG.open(path)?;
        let mut hash = blake3::Hasher::new();
        let waits = interrupt::waiting();
        (&file).rewind().and_then(|()| hash.update_reader(&file).map(drop)).map_err(|e| Error::io(path, "read", e))?;
        drop(waits);
        Stream::of(path, file, len, ContentHash(hash.finalize()), parquet_limits::OF_OTHERS)
    }

    fn of(path: &Path, file: File, len: u64, content: ContentHash, width: parquet_limits::Width) -> Result<Self> {
        let part = |from: u64, len: u64| {
            let mut bytes =
                vec![0; usize::try_from(len).ok().filter(|_| len <= MOST_PART_BYTES).ok_or("a part of it is too long")?];
            file.read_exact_at(&mut bytes, from).map_err(|e| e.to_string())?;
            Ok(Cow::Owned(bytes))
        };
        let rows = parquet_limits::check_parts(len, &part, width).map(rows_at_once).map_err(|why| cannot_decode(path, &why))?;
        let metadata = guarded(|| ArrowReaderMetadata::load(&file, ArrowReaderOptions::new()).map_err(|e| e.to_string()));
        let metadata = metadata.unwrap_or_else(|_| Err(BROKEN.into())).map_err(|why| cannot_decode(path, &why))?;
        Ok(Stream { file, metadata, rows, content })
    }

    /// The columns.
    pub(super) fn schema(&self) -> &SchemaRef {
        self.metadata.schema()
    }

    /// All rows, from the first on; an error is the last item.
    pub(super) fn batches(&self, path: &Path) -> Result<impl Iterator<Item = Result<RecordBatch>> + Send + use<>> {
        self.batches_of(path, ProjectionMask::all())
    }

    /// As [`Stream::batches`], of these columns alone.
    pub(super) fn columns(
        &self,
        path: &Path,
        names: &[&str],
    ) -> Result<impl Iterator<Item = Result<RecordBatch>> + Send + use<>> {
        let schema = self.metadata.parquet_schema();
        let roots: Vec<usize> = (self.schema().fields().iter().enumerate())
            .filter(|(_, field)| names.contains(&field.name().as_str()))
            .map(|(at, _)| at)
            .collect();
        self.batches_of(path, ProjectionMask::roots(schema, roots))
    }

    fn batches_of(
        &self,
        path: &Path,
        columns: ProjectionMask,
    ) -> Result<impl Iterator<Item = Result<RecordBatch>> + Send + use<>> {
        let path = path.to_path_buf();
        let file = self.file.try_clone().map_err(|e| Error::io(&path, "read", e))?;
        let builder = ParquetRecordBatchReaderBuilder::new_with_metadata(file, self.metadata.clone());
        let builder = builder.with_batch_size(self.rows).with_projection(columns);
        let mut reader = Some(builder.build().map_err(|e| cannot_decode(&path, &e.to_string()))?);
        Ok(std::iter::from_fn(move || {
            let batch = guarded(|| reader.as_mut()?.next()).unwrap_or(Some(Err(ArrowError::ParquetError(BROKEN.into()))))?;
            Some(batch.map_err(|e| {
                reader = None;
                cannot_decode(&path, &e.to_string())
            }))
        }))
    }
}
