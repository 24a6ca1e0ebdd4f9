//! Summaries as JSON: keys sorted, indented, with provenance and seal under the key `hilt`.

use super::{Provenance, atomic, provenance, read_bytes, seal};
use crate::error::{Error, Result};
use serde_json::{Map, Value, json};
use std::path::Path;

/// Writes an object with the further key `hilt`.
///
/// # Errors
/// As [`encode`]; [`Error::Io`] when the system refuses.
pub fn write(path: &Path, content: &Value, provenance: &Provenance) -> Result<()> {
    atomic::write_bytes(path, &encode(path, content, provenance)?)
}

/// The bytes of the file that [`write()`] writes to `path`.
///
/// # Errors
/// [`Error::Input`] when `content` is no JSON object.
pub fn encode(path: &Path, content: &Value, provenance: &Provenance) -> Result<Vec<u8>> {
    let Value::Object(fields) = content else {
        return Err(Error::input(path, "a summary is a JSON object"));
    };
    let mut fields = fields.clone();
    fields.insert(provenance::KEY.into(), json!({ "provenance": provenance, "seal": seal::blank() }));
    let mut text = serde_json::to_string_pretty(&fields).expect("a JSON value has string keys");
    text.push('\n');
    Ok(seal::close(text.into_bytes()))
}

/// Reads what [`write()`] wrote, without the key `hilt`.
///
/// # Errors
/// [`Error::Input`] when the file is no such JSON, is of another schema version or was changed.
pub fn read(path: &Path) -> Result<(Value, Provenance)> {
    let bytes = read_bytes(path)?;
    let mut fields: Map<String, Value> =
        serde_json::from_slice(&bytes).map_err(|e| Error::input(path, format!("is no JSON object: {e}")))?;
    let provenance = provenance_of(path, fields.remove(provenance::KEY))?;
    seal::check(path, &bytes)?;
    Ok((Value::Object(fields), provenance))
}

/// The provenance within the value of the key `hilt`.
pub(super) fn provenance_of(path: &Path, hilt: Option<Value>) -> Result<Provenance> {
    match hilt.and_then(|mut h| h.get_mut("provenance").map(Value::take)) {
        Some(found) => Provenance::from_value(path, found),
        None => Err(Error::input(path, "was not written by hilt: it has no \"hilt\" key with a provenance")),
    }
}
