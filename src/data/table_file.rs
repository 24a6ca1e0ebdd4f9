//! Tables (plans, metrics, evaluation logs) as Parquet; every column carries its description and unit in its own metadata.

use super::parquet_stream::Stream;
use super::{ContentHash, Provenance, atomic, parquet_file};
use crate::error::{Error, Result};
use crate::table::{Column, Table, Values, unit_of};
use arrow_array::cast::AsArray;
use arrow_array::types::{Float32Type, Float64Type, Int64Type};
use arrow_array::{
    Array, ArrayRef, ArrowPrimitiveType, BooleanArray, Float32Array, Float64Array, Int64Array, RecordBatch, StringArray,
};
use arrow_schema::{ArrowError, DataType, Field, Schema};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Field metadata: what the column is.
const DOC: &str = "doc";
/// Field metadata: its unit.
const UNIT: &str = "unit";

/// Writes a table. NaN is kept; a reader that cannot use it says so.
///
/// # Errors
/// As [`encode`]; [`Error::Io`] when the system refuses.
pub fn write(path: &Path, table: &Table, provenance: &Provenance) -> Result<()> {
    atomic::write_bytes(path, &encode(path, table, provenance)?)
}

/// Writes a table that need not fit into memory: its rows come in `groups` with the same columns, each of which becomes a row group.
/// Without any nothing is written.
///
/// # Errors
/// As [`write()`]; an error among the groups.
pub fn write_groups(path: &Path, mut groups: impl Iterator<Item = Result<Table>>, provenance: &Provenance) -> Result<()> {
    let Some(first) = groups.next().transpose()? else { return Ok(()) };
    let cannot = |e| parquet_file::cannot_encode(path, e);
    let first = checked_batch(path, &first)?;
    atomic::write_with(path, |file| {
        let mut writer = parquet_file::Writer::to(file, &first.schema(), provenance).map_err(cannot)?;
        writer.row_group(&first).map_err(cannot)?;
        for group in groups {
            writer.row_group(&checked_batch(path, &group?)?).map_err(cannot)?;
        }
        writer.finish_file().map_err(cannot)
    })
}

/// The bytes of the file that [`write()`] writes to `path`.
///
/// # Errors
/// [`Error::Input`] when the columns differ in length or share a name.
pub fn encode(path: &Path, table: &Table, provenance: &Provenance) -> Result<Vec<u8>> {
    parquet_file::of_batch(&checked_batch(path, table)?, provenance).map_err(|e| parquet_file::cannot_encode(path, e))
}

fn checked_batch(path: &Path, table: &Table) -> Result<RecordBatch> {
    for (i, column) in table.columns.iter().enumerate() {
        if column.values.len() != table.rows() {
            let message = format!("column {} has {} rows, the first has {}", column.name, column.values.len(), table.rows());
            return Err(Error::input(path, message));
        }
        if table.columns[..i].iter().any(|c| c.name == column.name) {
            return Err(Error::input(path, format!("two columns are named {}", column.name)));
        }
    }
    to_batch(table).map_err(|e| parquet_file::cannot_encode(path, e))
}

/// Reads what [`write()`] wrote.
///
/// # Errors
/// [`Error::Input`] when the file is missing its end, damaged, foreign or of another schema version, [`Error::Io`] when it
/// cannot be read at all.
pub fn read(path: &Path) -> Result<(Table, Provenance)> {
    read_hashed(path).map(|(table, provenance, _)| (table, provenance))
}

/// As [`read`], with the hash of the bytes that were read.
///
/// # Errors
/// As [`read`].
pub fn read_hashed(path: &Path) -> Result<(Table, Provenance, ContentHash)> {
    let bytes = parquet_file::FORMAT.read(path)?;
    let hash = ContentHash::of(&bytes);
    decode(path, bytes).map(|(table, provenance)| (table, provenance, hash))
}

fn decode(path: &Path, bytes: Vec<u8>) -> Result<(Table, Provenance)> {
    let (schema, batches) = parquet_file::open(path, bytes)?;
    let provenance = parquet_file::provenance_of(path, &schema)?;
    Ok((of_batches(path, &schema, &batches)?, provenance))
}

fn of_batches(path: &Path, schema: &Schema, batches: &[RecordBatch]) -> Result<Table> {
    let mut table = Table::default();
    for (i, field) in schema.fields().iter().enumerate() {
        let values =
            gather(field.data_type(), batches.iter().map(|b| b.column(i))).ok_or_else(|| Error::input(path, no_table(field)))?;
        let doc = field.metadata().get(DOC).map(|d| d.to_string()).unwrap_or_default();
        table.columns.push(Column { name: field.name().clone(), doc, values });
    }
    Ok(table)
}

/// A table that is read in pieces of some thousand rows, as often as wanted.
pub struct Reader {
    path: PathBuf,
    stream: Stream,
    provenance: Provenance,
}

impl Reader {
    /// Checks a file that [`write()`] or [`write_groups`] wrote.
    ///
    /// # Errors
    /// As [`read`].
    pub fn open(path: &Path) -> Result<Self> {
        let stream = Stream::open(path)?;
        let provenance = parquet_file::provenance_of(path, stream.schema())?;
        Ok(Reader { path: path.to_path_buf(), stream, provenance })
    }

    /// What the file carries of its origin.
    pub fn provenance(&self) -> &Provenance {
        &self.provenance
    }

    /// Its columns without their values.
    ///
    /// # Errors
    /// As [`read`].
    pub fn no_rows(&self) -> Result<Table> {
        of_batches(&self.path, self.stream.schema(), &[])
    }

    /// The hash of the file's bytes.
    pub fn content(&self) -> ContentHash {
        self.stream.content
    }

    /// All rows, one piece of the table after another. One pass at a time.
    ///
    /// # Errors
    /// As [`read`]; the items have those of what is read late.
    pub fn tables(&self) -> Result<impl Iterator<Item = Result<Table>> + Send> {
        let batches = self.stream.batches(&self.path)?;
        Ok(batches.map(|batch| batch.and_then(|batch| of_batches(&self.path, &batch.schema(), &[batch]))))
    }
}

fn no_table(field: &Field) -> String {
    let (name, kind) = (field.name(), field.data_type());
    format!("is no table: column {name} has type {kind}; for a part of a dataset name the dataset's root")
}

fn to_batch(table: &Table) -> std::result::Result<RecordBatch, ArrowError> {
    let mut fields = Vec::with_capacity(table.columns.len());
    let mut arrays: Vec<ArrayRef> = Vec::with_capacity(table.columns.len());
    for column in &table.columns {
        let array: ArrayRef = match &column.values {
            Values::F32(v) => Arc::new(Float32Array::from(v.clone())),
            Values::F64(v) => Arc::new(Float64Array::from(v.clone())),
            Values::I64(v) => Arc::new(Int64Array::from(v.clone())),
            Values::Bool(v) => Arc::new(BooleanArray::from(v.clone())),
            Values::Text(v) => Arc::new(StringArray::from(v.clone())),
        };
        let mut metadata = arrow_schema::Metadata::new().with(DOC, column.doc.clone());
        if let Some(unit) = unit_of(&column.name) {
            metadata.insert(UNIT, unit);
        }
        fields.push(Field::new(&column.name, array.data_type().clone(), false).with_metadata(metadata));
        arrays.push(array);
    }
    let options = arrow_array::RecordBatchOptions::new().with_row_count(Some(table.rows()));
    RecordBatch::try_new_with_options(Arc::new(Schema::new(fields)), arrays, &options)
}

/// The values of a column's pieces; `None` for a type that tables do not have.
fn gather<'a>(kind: &DataType, pieces: impl Iterator<Item = &'a ArrayRef>) -> Option<Values> {
    Some(match kind {
        DataType::Float32 => Values::F32(numbers::<Float32Type>(pieces)),
        DataType::Float64 => Values::F64(numbers::<Float64Type>(pieces)),
        DataType::Int64 => Values::I64(numbers::<Int64Type>(pieces)),
        DataType::Boolean => Values::Bool(pieces.flat_map(|a| a.as_boolean().values().iter()).collect()),
        DataType::Utf8 => {
            Values::Text(pieces.flat_map(|a| a.as_string::<i32>().iter().map(|s| s.unwrap_or_default().to_string())).collect())
        }
        _ => return None,
    })
}

fn numbers<'a, T: ArrowPrimitiveType>(pieces: impl Iterator<Item = &'a ArrayRef>) -> Vec<T::Native> {
    pieces.flat_map(|a| a.as_primitive::<T>().values().iter().copied()).collect()
}
