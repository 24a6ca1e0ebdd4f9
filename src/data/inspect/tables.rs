//! A table, described in the memory of some thousand of its rows.

use super::answer::answer;
use super::statistics::Running;
use crate::data::table_file::Reader;
use crate::error::Result;
use crate::table::{Column, Table, Values, unit_of};
use serde_json::{Map, Value, json};
use std::collections::HashSet;
use std::path::Path;

pub(super) fn one(path: &Path) -> Result<Value> {
    let reader = Reader::open(path)?;
    let columns = reader.no_rows()?.columns;
    let (mut rows, mut found) = (0, columns.iter().map(Found::nothing).collect::<Vec<_>>());
    for piece in reader.tables()? {
        let piece = piece?;
        rows += piece.rows();
        each(&mut found, &piece, Found::add);
    }
    for piece in reader.tables()? {
        each(&mut found, &piece?, Found::add_again);
    }
    let columns: Vec<Value> = columns.iter().zip(&found).map(described).collect();
    Ok(answer("table", reader.provenance(), json!({ "rows": rows, "columns": columns })))
}

fn each(found: &mut [Found], piece: &Table, take: fn(&mut Found, &Values)) {
    found.iter_mut().zip(&piece.columns).for_each(|(found, column)| take(found, &column.values));
}

/// What has been seen of a column.
enum Found {
    Numbers(&'static str, Running),
    Flags(usize),
    /// By their hashes: the texts themselves may be longer than the memory.
    Texts(HashSet<blake3::Hash>),
}

impl Found {
    fn nothing(column: &Column) -> Self {
        match column.values {
            Values::F32(_) => Found::Numbers("f32", Running::NONE),
            Values::F64(_) => Found::Numbers("f64", Running::NONE),
            Values::I64(_) => Found::Numbers("i64", Running::NONE),
            Values::Bool(_) => Found::Flags(0),
            Values::Text(_) => Found::Texts(HashSet::new()),
        }
    }

    fn add(&mut self, values: &Values) {
        match (self, values) {
            (Found::Numbers(_, running), values) => numbers(values, |value| running.add(value)),
            (Found::Flags(set), Values::Bool(v)) => *set += v.iter().filter(|x| **x).count(),
            (Found::Texts(texts), Values::Text(v)) => texts.extend(v.iter().map(|text| blake3::hash(text.as_bytes()))),
            _ => {}
        }
    }

    fn add_again(&mut self, values: &Values) {
        if let Found::Numbers(_, running) = self {
            numbers(values, |value| running.add_again(value));
        }
    }
}

fn numbers(values: &Values, mut take: impl FnMut(f64)) {
    match values {
        Values::F32(v) => v.iter().for_each(|x| take(f64::from(*x))),
        Values::F64(v) => v.iter().for_each(|x| take(*x)),
        Values::I64(v) => v.iter().for_each(|x| take(*x as f64)),
        Values::Bool(_) | Values::Text(_) => {}
    }
}

fn described((column, found): (&Column, &Found)) -> Value {
    let (kind, mut fields) = match found {
        Found::Numbers(kind, running) => (*kind, running.describe()),
        Found::Flags(set) => ("bool", Map::from_iter([("true".to_string(), json!(set))])),
        Found::Texts(texts) => ("text", Map::from_iter([("distinct".to_string(), json!(texts.len()))])),
    };
    fields.extend([("name", json!(column.name)), ("type", json!(kind)), ("doc", json!(column.doc))].map(|(k, v)| (k.into(), v)));
    if let Some(unit) = unit_of(&column.name) {
        fields.insert("unit".into(), json!(unit));
    }
    Value::Object(fields)
}
