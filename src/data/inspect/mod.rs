//! What any artefact is: kind, provenance, shapes, counts, statistics; as JSON and as words.

mod answer;
mod datasets;
mod foreign;
mod recordings;
mod statistics;
mod tables;
mod text;

pub use text::inspect_text;

use super::dataset::{TRAIN, VALIDATION};
use super::peek::{Format, format_of};
use super::{bytes, json_file, weights};
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use answer::answer;
use serde_json::{Map, Value, json};
use statistics::statistics;
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
        Format::Parquet => tables::one(path),
        Format::Safetensors => network(path),
        Format::Json => summary(path),
        Format::Onnx => Err(Error::input(path, "is a network for other programs (ONNX); inspect the policy that it was made of")),
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
        return datasets::one(path, interrupt);
    }
    let roots: Vec<&str> = [TRAIN, VALIDATION].into_iter().filter(|name| path.join(name).is_dir()).collect();
    if !roots.is_empty() {
        let mut found = Map::from_iter([("kind".to_string(), json!("datasets"))]);
        for name in roots {
            found.insert(name.into(), datasets::one(&path.join(name), interrupt)?);
        }
        return Ok(Value::Object(found));
    }
    if path.extension().is_some_and(|ending| ending == UNFINISHED) {
        let message = "is not finished: it holds the pieces of a stage that was stopped; run its command again to go on";
        return Err(Error::input(path, message));
    }
    recordings::all(path, interrupt)
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
