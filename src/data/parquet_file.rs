//! What all our Parquet files share: zstd, provenance and seal in the metadata, checked before decoding.

use super::budget::Budget;
use super::bytes::{Ends, Format};
use super::{Provenance, parquet_limits, provenance, seal};
use crate::error::{Error, Result};
use crate::guard::guarded;
use arrow_array::RecordBatch;
use arrow_schema::{Schema, SchemaRef};
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::arrow::arrow_writer::ArrowRowGroupWriterFactory;
use parquet::basic::{Compression, ZstdLevel};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use prost::bytes::Bytes;
use std::fs::File;
use std::io::{self, Write};
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::sync::Arc;

/// Who wrote the file, in Parquet's own "application version x" form.
const CREATED_BY: &str = concat!("hilt version ", env!("CARGO_PKG_VERSION"));
/// The same of any version.
const BY_HILT: &[u8] = b"hilt version ";
/// Metadata key of the seal.
const SEAL_KEY: &str = "hilt.seal";

/// A Parquet file that grows by batches, in memory or on the disk.
pub(super) struct Writer<W: Write + Send = Vec<u8>> {
    writer: ArrowWriter<W>,
}

impl Writer {
    /// As [`Writer::to`], in memory.
    pub(super) fn new(schema: &Schema, provenance: &Provenance) -> std::result::Result<Self, ParquetError> {
        Writer::to(Vec::new(), schema, provenance)
    }

    /// The whole file, sealed.
    pub(super) fn finish(self) -> std::result::Result<Vec<u8>, ParquetError> {
        Ok(seal::close(self.writer.into_inner()?))
    }
}

impl Writer<&mut File> {
    /// Ends the file and seals it.
    pub(super) fn finish_file(self) -> std::result::Result<(), ParquetError> {
        let file = self.writer.into_inner()?;
        let tail = tail_bytes(file)?;
        Ok(seal::close_file(file, tail)?)
    }
}

impl<W: Write + Send> Writer<W> {
    /// A file of `schema`, with `provenance` in the metadata of the Arrow schema (where pyarrow looks) and of the file.
    pub(super) fn to(to: W, schema: &Schema, provenance: &Provenance) -> std::result::Result<Self, ParquetError> {
        let json = provenance.to_json();
        let mut metadata = schema.metadata().clone();
        metadata.insert(provenance::KEY, json.clone());
        let schema = Arc::new(schema.clone().with_metadata(metadata));
        let entry = |key: &str, value: String| KeyValue { key: key.into(), value: Some(value) };
        let properties = WriterProperties::builder()
            .set_created_by(CREATED_BY.into())
            .set_compression(Compression::ZSTD(ZstdLevel::default()))
            .set_key_value_metadata(Some(vec![entry(provenance::KEY, json), entry(SEAL_KEY, seal::blank())]))
            .build();
        Ok(Writer { writer: ArrowWriter::try_new(to, schema, Some(properties))? })
    }

    /// Adds a batch as its own row group.
    pub(super) fn row_group(&mut self, batch: &RecordBatch) -> std::result::Result<(), ParquetError> {
        self.writer.write(batch)?;
        self.writer.flush()
    }

    /// The empty file, and what encodes its row groups elsewhere.
    pub(super) fn into_parts(self) -> std::result::Result<(SerializedFileWriter<W>, ArrowRowGroupWriterFactory), ParquetError> {
        self.writer.into_serialized_writer()
    }
}

/// One batch as one file.
pub(super) fn of_batch(batch: &RecordBatch, provenance: &Provenance) -> std::result::Result<Vec<u8>, ParquetError> {
    let mut writer = Writer::new(&batch.schema(), provenance)?;
    writer.row_group(batch)?;
    writer.finish()
}

/// An error while encoding what hilt itself made.
pub(super) fn cannot_encode(path: &Path, error: impl std::fmt::Display) -> Error {
    Error::input(path, format!("cannot be encoded as Parquet: {error}"))
}

/// What our Parquet files look like from outside.
pub(super) const FORMAT: Format = Format {
    most_bytes: 4 << 30,
    reason: "a file of a dataset is closed at 100 MB, and a table that is read as a whole has some kilobytes",
    head: check_head,
    ends: check_ends,
};
/// The same of a file that is read in parts.
pub(super) const LONG: Format =
    Format { most_bytes: 100 << 30, reason: "100,000 plans of 10,000 steps, the most there can be, have some 80 GB", ..FORMAT };
/// The format's name, at either end of a file.
const MAGIC: &[u8] = b"PAR1";
/// Who wrote a file is said behind its columns, at the end of its metadata.
pub(super) const WRITER_WITHIN: usize = 4096;

fn check_head(path: &Path, head: &[u8]) -> Result<()> {
    if head.starts_with(MAGIC) {
        return Ok(());
    }
    Err(Error::input(path, "is not a Parquet file; expected one written by hilt"))
}

fn check_ends(path: &Path, ends: &Ends) -> Result<()> {
    if ends.tail(path, MAGIC.len())?.as_ref() == MAGIC {
        return Ok(());
    }
    Err(Error::input(path, "is a Parquet file without its end: it is cut short; run the stage that makes it again"))
}

/// Whether this is a Parquet file that another program wrote (or rewrote).
pub(super) fn is_foreign(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC) && bytes.ends_with(MAGIC) && ends_as_foreign(bytes)
}

pub(super) fn ends_as_foreign(bytes: &[u8]) -> bool {
    seal::find_last(&bytes[bytes.len().saturating_sub(WRITER_WITHIN)..], BY_HILT).is_none()
}

pub(super) fn foreign(path: &Path) -> Error {
    Error::input(path, "was written by another program than hilt; run the stage that makes it again")
}

/// Checks the seal, then decodes.
///
/// # Errors
/// [`Error::Input`] with the reason.
pub(super) fn open(path: &Path, bytes: Vec<u8>) -> Result<(SchemaRef, Vec<RecordBatch>)> {
    FORMAT.check(path, &bytes)?;
    if is_foreign(&bytes) {
        return Err(foreign(path));
    }
    seal::check(path, &bytes)?;
    decode(bytes).map_err(|e| cannot_decode(path, &e))
}

pub(super) fn cannot_decode(path: &Path, why: &str) -> Error {
    Error::input(path, format!("cannot be decoded: {why}"))
}

/// The panic of a decoder, in words.
pub(super) const BROKEN: &str = "its inner structure is broken";

/// Rows that are decoded at once, where they are short.
const ROWS_AT_ONCE: usize = 8192;
/// Texts that are decoded at once take no more than this \[bytes\].
const TEXTS_AT_ONCE: usize = 64 << 20;

/// All batches of a Parquet file, as long as they are no larger than its size allows.
pub(super) fn decode(bytes: Vec<u8>) -> std::result::Result<(SchemaRef, Vec<RecordBatch>), String> {
    let mut batches = Vec::new();
    let schema = decode_each(bytes, &mut |batch| {
        batches.push(batch.clone());
        Ok(())
    })?;
    Ok((schema, batches))
}

/// What is shown a batch.
type See<'a> = dyn FnMut(&RecordBatch) -> std::result::Result<(), String> + 'a;

/// As [`decode`], one batch after the other.
pub(super) fn decode_each(bytes: Vec<u8>, see: &mut See) -> std::result::Result<SchemaRef, String> {
    let longest_text = parquet_limits::check(&bytes)?;
    let rows = rows_at_once(longest_text);
    let mut budget = Budget::new();
    budget.allow_for(bytes.len() as u64);
    guarded(|| {
        let builder = ParquetRecordBatchReaderBuilder::try_new(Bytes::from(bytes)).map_err(|e| e.to_string())?;
        let schema = Arc::clone(builder.schema());
        for batch in builder.with_batch_size(rows).build().map_err(|e| e.to_string())? {
            let batch = batch.map_err(|e| e.to_string())?;
            budget.take(batch.get_array_memory_size() as u64)?;
            see(&batch)?;
        }
        Ok(schema)
    })
    .unwrap_or_else(|_| Err(BROKEN.into()))
}

pub(super) fn rows_at_once(longest_text: usize) -> usize {
    (TEXTS_AT_ONCE / longest_text.max(1)).clamp(1, ROWS_AT_ONCE)
}

/// Bytes at the end of a file that hold its seal: the metadata, and what follows them.
pub(super) fn tail_bytes(file: &File) -> io::Result<u64> {
    let mut tail = [0; (size_of::<u32>() + MAGIC.len())];
    let len = tail.len() as u64;
    file.read_exact_at(&mut tail, file.metadata()?.len().saturating_sub(len))?;
    Ok((parquet_limits::metadata_bytes(&tail) + len).min(MOST_PART_BYTES))
}

/// No column of a row group and no metadata that are read at once are longer: those of 100,000 plans have 12 MB.
pub(super) const MOST_PART_BYTES: u64 = 256 << 20;

/// The provenance in a schema's metadata.
pub(super) fn provenance_of(path: &Path, schema: &Schema) -> Result<Provenance> {
    match schema.metadata().get(provenance::KEY) {
        Some(json) => Provenance::from_json(path, json),
        None => Err(Error::input(path, "was not written by hilt: its metadata has no \"hilt\" key")),
    }
}
