//! In which keys two settings differ.

use serde_json::{Map, Value};

/// A dotted key and its two values.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// The key.
    pub key: String,
    /// Its value there, or the word "missing".
    pub theirs: Value,
    /// Its value here, or the word "missing".
    pub ours: Value,
}

/// All keys whose values differ, under the dotted name `root`: first those of `theirs`.
pub fn differences(root: &str, theirs: &Value, ours: &Value) -> Vec<Difference> {
    let fields = |value: &Value| {
        let mut found = Vec::new();
        flatten(root, value, &mut found);
        Map::from_iter(found)
    };
    let (theirs, ours) = (fields(theirs), fields(ours));
    let missing = |map: &Map<String, Value>, key: &str| map.get(key).cloned().unwrap_or_else(|| "missing".into());
    let new = ours.keys().filter(|key| !theirs.contains_key(*key));
    let keys = theirs.keys().chain(new).filter(|key| theirs.get(*key) != ours.get(*key));
    keys.map(|key| Difference { key: key.clone(), theirs: missing(&theirs, key), ours: missing(&ours, key) }).collect()
}

/// Objects as dotted keys.
fn flatten(name: &str, value: &Value, out: &mut Vec<(String, Value)>) {
    match value {
        Value::Object(fields) => fields.iter().for_each(|(key, value)| {
            let name = if name.is_empty() { key.clone() } else { format!("{name}.{key}") };
            flatten(&name, value, out);
        }),
        other => out.push((name.into(), other.clone())),
    }
}
