//! What every answer begins with.

use crate::data::Provenance;
use serde_json::{Map, Value, json};

/// The first fields of every answer.
pub fn answer(kind: &str, provenance: &Provenance, rest: Value) -> Value {
    let mut fields = Map::from_iter([("kind".to_string(), json!(kind)), ("provenance".to_string(), json!(provenance))]);
    if let Value::Object(rest) = rest {
        fields.extend(rest);
    }
    Value::Object(fields)
}
