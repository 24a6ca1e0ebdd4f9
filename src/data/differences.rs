//! In which keys two settings, or two provenances, differ.

use super::Provenance;
use serde_json::{Map, Value};
use std::fmt;

/// Parts of a provenance, in the order in which two are compared.
const PARTS: [&str; 7] = ["hilt_version", "schema_version", "stage", "task", "seed", "settings", "inputs"];

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

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} was {}, now it is {}", self.key, self.theirs, self.ours)
    }
}

/// The first key in which two provenances differ.
pub fn first_difference(theirs: &Provenance, ours: &Provenance) -> Option<Difference> {
    let value = |provenance: &Provenance| serde_json::to_value(provenance).expect("a provenance has string keys only");
    let (theirs, ours) = (value(theirs), value(ours));
    PARTS.iter().find_map(|part| {
        let name = if *part == "settings" { "" } else { part };
        differences(name, &theirs[*part], &ours[*part]).into_iter().next()
    })
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

/// All values of a settings object by their dotted keys, in order.
pub fn flattened(settings: &Value) -> Vec<(String, Value)> {
    let mut found = Vec::new();
    flatten("", settings, &mut found);
    found
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

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn the_first_difference_has_its_key_and_both_values() {
        let one = Provenance::new("train", "stack", json!({"method": "hil", "train": {"rho": 0.3, "tau": 0.5}}), 1);
        let difference = |change: fn(&mut Provenance)| {
            let mut other = one.clone();
            change(&mut other);
            first_difference(&one, &other).map(|found| found.to_string())
        };
        let found = |key: &str, theirs: &str, ours: &str| Some(format!("{key} was {theirs}, now it is {ours}"));
        assert_eq!(difference(|_| {}), None);
        assert_eq!(difference(|p| p.seed = 2), found("seed", "1", "2"));
        assert_eq!(difference(|p| p.settings["train"]["rho"] = 0.4.into()), found("train.rho", "0.3", "0.4"));
        assert_eq!(difference(|p| p.settings["method"] = "bc".into()), found("method", "\"hil\"", "\"bc\""));
        let with_input = |p: &mut Provenance| drop(p.inputs.insert("dataset".into(), "ab".into()));
        assert_eq!(difference(with_input), found("inputs.dataset", "\"missing\"", "\"ab\""));
    }
}
