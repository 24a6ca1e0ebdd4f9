//! Summaries as JSON: keys sorted, indented, with provenance and seal under the key `hilt`.

use super::bytes::{Ends, Format};
use super::{ContentHash, Provenance, atomic, json_text, provenance, seal};
use crate::error::{Error, Result};
use crate::guard::guarded;
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

/// What a summary looks like from outside.
const FORMAT: Format = Format {
    most_bytes: 64 << 20,
    reason: "a summary of 100,000 episodes has less than 1 MB",
    head: check_head,
    ends: check_ends,
};
/// More blanks at an end than any program writes.
const END_BYTES: usize = 64;

fn check_head(path: &Path, head: &[u8]) -> Result<()> {
    match head.trim_ascii_start().first() {
        Some(b'{') => Ok(()),
        _ => Err(Error::input(path, "is no JSON object; expected a summary of hilt evaluate")),
    }
}

fn check_ends(path: &Path, ends: &Ends) -> Result<()> {
    if !ends.tail(path, END_BYTES)?.trim_ascii_end().ends_with(b"}") {
        return Err(Error::input(path, "is a JSON object without its end: it is cut short; run the stage that makes it again"));
    }
    Ok(())
}

/// Reads what [`write()`] wrote, without the key `hilt`.
///
/// # Errors
/// [`Error::Input`] when the file is no such JSON, is of another schema version or was changed.
pub fn read(path: &Path) -> Result<(Value, Provenance)> {
    read_hashed(path).map(|(value, provenance, _)| (value, provenance))
}

/// As [`read`], with the hash of the bytes that were read.
///
/// # Errors
/// As [`read`].
pub fn read_hashed(path: &Path) -> Result<(Value, Provenance, ContentHash)> {
    let bytes = FORMAT.read(path)?;
    let hash = ContentHash::of(&bytes);
    decode(path, &bytes).map(|(value, provenance)| (value, provenance, hash))
}

/// The summary in the bytes of the file at `path`.
///
/// # Errors
/// [`Error::Input`] as [`read`].
pub fn decode(path: &Path, bytes: &[u8]) -> Result<(Value, Provenance)> {
    FORMAT.check(path, bytes)?;
    seal::check(path, bytes)?;
    let decoded = guarded(|| {
        let fields = json_text::parse(bytes);
        let mut fields: Map<String, Value> = fields.map_err(|why| Error::input(path, format!("is no JSON object: {why}")))?;
        let provenance = provenance_of(path, fields.remove(provenance::KEY))?;
        Ok((Value::Object(fields), provenance))
    });
    decoded.unwrap_or_else(|why| Err(Error::input(path, format!("damaged: {why}"))))
}

/// The provenance within the value of the key `hilt`.
pub(super) fn provenance_of(path: &Path, hilt: Option<Value>) -> Result<Provenance> {
    match hilt.and_then(|mut h| h.get_mut("provenance").map(Value::take)) {
        Some(found) => Provenance::from_value(path, found),
        None => Err(Error::input(path, "was not written by hilt: it has no \"hilt\" key with a provenance")),
    }
}
