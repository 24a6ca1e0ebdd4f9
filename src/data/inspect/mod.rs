//! What any artefact is: kind, provenance, shapes, counts, statistics; as JSON and as words.

mod datasets;
mod recordings;
mod text;

pub use text::inspect_text;

use super::dataset::{TRAIN, VALIDATION};
use super::peek::{Format, format_of};
use super::{Provenance, bytes, json_file, recording, table_file, weights};
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use crate::table::{Column, Values};
use serde_json::{Map, Value, json};
use std::collections::BTreeSet;
use std::path::Path;

/// The ending of a directory of pieces.
const UNFINISHED: &str = "unfinished";

/// Describes the artefact at `path`: a recording or a directory of them, a table, a dataset or the pair of datasets, weights, a
/// summary. The field `kind` says which; `provenance` is what it carries of its origin.
///
/// # Errors
/// [`Error::Input`] when it is none of these, or is one that its own reader refuses; [`Error::Io`] when it cannot be read;
/// [`Error::Interrupted`].
pub fn inspect(path: &Path, interrupt: &Interrupt) -> Result<Value> {
    if path.is_dir() {
        return directory(path, interrupt);
    }
    match format(path)? {
        Format::Mcap => recordings::one(path),
        Format::Parquet => table(path),
        Format::Safetensors => network(path),
        Format::Json => summary(path),
        _ => Err(Error::input(
            path,
            "is no artefact of hilt; expected a recording (MCAP), a table (Parquet), weights (safetensors), a summary (JSON), a dataset or \
             a directory of recordings",
        )),
    }
}

/// The format that a file's first bytes tell, whatever its ending; where they tell none, and for what can be read only once (a pipe),
/// that of its ending, whose reader says what is missing.
fn format(path: &Path) -> Result<Format> {
    let kind = std::fs::metadata(path).map_err(|e| Error::io(path, "read", e))?;
    if kind.is_file() {
        let head = bytes::head(path)?;
        bytes::refuse_placeholder(path, &head)?;
        match format_of(&head) {
            Format::Other => {}
            known => return Ok(known),
        }
    }
    Ok(match path.extension().and_then(|e| e.to_str()) {
        Some("mcap") => Format::Mcap,
        Some("parquet") => Format::Parquet,
        Some("safetensors") => Format::Safetensors,
        Some("json") => Format::Json,
        _ => Format::Other,
    })
}

fn directory(path: &Path, interrupt: &Interrupt) -> Result<Value> {
    if path.join("meta").is_dir() {
        return datasets::one(path);
    }
    let roots: Vec<&str> = [TRAIN, VALIDATION].into_iter().filter(|name| path.join(name).is_dir()).collect();
    if !roots.is_empty() {
        let mut found = Map::from_iter([("kind".to_string(), json!("datasets"))]);
        for name in roots {
            found.insert(name.into(), datasets::one(&path.join(name))?);
        }
        return Ok(Value::Object(found));
    }
    if path.extension().is_some_and(|ending| ending == UNFINISHED) {
        let message = "is not finished: it holds the pieces of a stage that was stopped; run its command again to go on";
        return Err(Error::input(path, message));
    }
    recordings::all(path, interrupt)
}

/// The first fields of every answer.
fn answer(kind: &str, provenance: &Provenance, rest: Value) -> Value {
    let mut fields = Map::from_iter([("kind".to_string(), json!(kind)), ("provenance".to_string(), json!(provenance))]);
    if let Value::Object(rest) = rest {
        fields.extend(rest);
    }
    Value::Object(fields)
}

/// Count, range, mean and standard deviation (ddof 0) of the finite values; `not_finite` appears when some are not.
fn statistics(values: impl Iterator<Item = f64>) -> Map<String, Value> {
    let (mut finite, mut others) = (Vec::new(), 0);
    for value in values {
        if value.is_finite() { finite.push(value) } else { others += 1 }
    }
    let n = finite.len() as f64;
    let mean = finite.iter().sum::<f64>() / n;
    let std = (finite.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt();
    let mut fields = Map::new();
    if !finite.is_empty() {
        let min = finite.iter().copied().fold(f64::INFINITY, f64::min);
        let max = finite.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        fields.extend([("min", min), ("max", max), ("mean", mean), ("std", std)].map(|(k, v)| (k.to_string(), json!(v))));
    }
    if others > 0 {
        fields.insert("not_finite".into(), json!(others));
    }
    fields
}

/// Statistics of each entry of row-major rows.
fn by_entry(names: &[String], rows: &[f32]) -> Vec<Value> {
    let column = |i: usize| rows.iter().skip(i).step_by(names.len()).map(|v| f64::from(*v));
    let entry = |(i, name): (usize, &String)| {
        let mut fields = statistics(column(i));
        fields.insert("name".into(), json!(name));
        Value::Object(fields)
    };
    names.iter().enumerate().map(entry).collect()
}

fn table(path: &Path) -> Result<Value> {
    let (table, provenance) = table_file::read(path)?;
    let columns: Vec<Value> = table.columns.iter().map(described_column).collect();
    Ok(answer("table", &provenance, json!({ "rows": table.rows(), "columns": columns })))
}

fn described_column(column: &Column) -> Value {
    let (kind, mut fields) = match &column.values {
        Values::F32(v) => ("f32", statistics(v.iter().map(|x| f64::from(*x)))),
        Values::F64(v) => ("f64", statistics(v.iter().copied())),
        Values::I64(v) => ("i64", statistics(v.iter().map(|x| *x as f64))),
        Values::Bool(v) => ("bool", Map::from_iter([("true".to_string(), json!(v.iter().filter(|x| **x).count()))])),
        Values::Text(v) => ("text", Map::from_iter([("distinct".to_string(), json!(v.iter().collect::<BTreeSet<_>>().len()))])),
    };
    fields.extend([("name", json!(column.name)), ("type", json!(kind)), ("doc", json!(column.doc))].map(|(k, v)| (k.into(), v)));
    if let Some(unit) = table_file::unit_of(&column.name) {
        fields.insert("unit".into(), json!(unit));
    }
    Value::Object(fields)
}

fn network(path: &Path) -> Result<Value> {
    let (kind, tensors, meta, provenance) = weights::read_any(path)?;
    let described: Vec<Value> = tensors
        .iter()
        .map(|t| {
            let mut fields = statistics(t.data.iter().map(|v| f64::from(*v)));
            fields.extend([("name".to_string(), json!(t.name)), ("shape".to_string(), json!(t.shape))]);
            Value::Object(fields)
        })
        .collect();
    let parameters: usize = tensors.iter().map(|t| t.data.len()).sum();
    Ok(answer("weights", &provenance, json!({ "network": kind, "parameters": parameters, "tensors": described, "meta": meta })))
}

fn summary(path: &Path) -> Result<Value> {
    let (content, provenance) = json_file::read(path)?;
    Ok(answer("summary", &provenance, json!({ "content": content })))
}
