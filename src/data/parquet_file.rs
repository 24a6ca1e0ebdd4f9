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
use std::path::Path;
use std::sync::Arc;

/// Who wrote the file, in Parquet's own "application version x" form.
const CREATED_BY: &str = concat!("hilt version ", env!("CARGO_PKG_VERSION"));
/// Metadata key of the seal.
const SEAL_KEY: &str = "hilt.seal";

/// A Parquet file in memory that grows by batches.
pub(super) struct Writer {
    writer: ArrowWriter<Vec<u8>>,
}

impl Writer {
    /// A file of `schema`, with `provenance` in the metadata of the Arrow schema (where pyarrow looks) and of the file.
    pub(super) fn new(schema: &Schema, provenance: &Provenance) -> std::result::Result<Self, ParquetError> {
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
        Ok(Writer { writer: ArrowWriter::try_new(Vec::new(), schema, Some(properties))? })
    }

    /// Adds a batch as its own row group.
    pub(super) fn row_group(&mut self, batch: &RecordBatch) -> std::result::Result<(), ParquetError> {
        self.writer.write(batch)?;
        self.writer.flush()
    }

    /// The empty file, and what encodes its row groups elsewhere.
    pub(super) fn into_parts(
        self,
    ) -> std::result::Result<(SerializedFileWriter<Vec<u8>>, ArrowRowGroupWriterFactory), ParquetError> {
        self.writer.into_serialized_writer()
    }

    /// The whole file, sealed.
    pub(super) fn finish(self) -> std::result::Result<Vec<u8>, ParquetError> {
        Ok(seal::close(self.writer.into_inner()?))
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
    reason: "100,000 plans have some 800 MB, and a file of a dataset is closed at 100 MB",
    head: check_head,
    ends: check_ends,
};
/// The format's name, at either end of a file.
const MAGIC: &[u8] = b"PAR1";
/// Who wrote a file is said behind its columns, at the end of its metadata.
const WRITER_WITHIN: usize = 4096;

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
    let tail = &bytes[bytes.len().saturating_sub(WRITER_WITHIN)..];
    bytes.starts_with(MAGIC) && bytes.ends_with(MAGIC) && seal::find_last(tail, CREATED_BY.as_bytes()).is_none()
}

/// Checks the seal, then decodes.
///
/// # Errors
/// [`Error::Input`] with the reason.
pub(super) fn open(path: &Path, bytes: Vec<u8>) -> Result<(SchemaRef, Vec<RecordBatch>)> {
    FORMAT.check(path, &bytes)?;
    if is_foreign(&bytes) {
        return Err(Error::input(path, "was written by another program than hilt; run the stage that makes it again"));
    }
    seal::check(path, &bytes)?;
    decode(bytes).map_err(|e| Error::input(path, format!("cannot be decoded: {e}")))
}

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
    let rows = (TEXTS_AT_ONCE / longest_text.max(1)).clamp(1, ROWS_AT_ONCE);
    let mut budget = Budget::new();
    budget.allow_for(bytes.len());
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
    .unwrap_or_else(|_| Err("its inner structure is broken".into()))
}

/// The provenance in a schema's metadata.
pub(super) fn provenance_of(path: &Path, schema: &Schema) -> Result<Provenance> {
    match schema.metadata().get(provenance::KEY) {
        Some(json) => Provenance::from_json(path, json),
        None => Err(Error::input(path, "was not written by hilt: its metadata has no \"hilt\" key")),
    }
}
