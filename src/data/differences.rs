//! In which keys two settings, or two provenances, differ.

use super::Provenance;
use serde_json::{Map, Value};
use std::fmt;

/// Parts of a provenance, in the order in which two are compared.
const PARTS: [&str; 7] = ["hilt_version", "schema_version", "stage", "task", "seed", "settings", "inputs"];

/// Settings that older versions did not have, and the values that stand for how they acted: where one side lacks such a key, that value is no difference.
const YOUNGER: [(&str, f64); 4] = [
    ("scene.finger_friction", 1.0),
    ("simulate.delay_steps", 0.0),
    ("train.randomise.fingers_rad", 0.0),
    ("train.randomise.objects_rad", 0.0),
];

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
    let differs = |key: &String| match (theirs.get(key), ours.get(key)) {
        (Some(value), None) | (None, Some(value)) => !is_as_before(key, value),
        (theirs, ours) => theirs != ours,
    };
    let keys = theirs.keys().chain(new).filter(|key| differs(key));
    keys.map(|key| Difference { key: key.clone(), theirs: missing(&theirs, key), ours: missing(&ours, key) }).collect()
}

/// Whether a version without the key acted as this value says.
fn is_as_before(key: &str, value: &Value) -> bool {
    YOUNGER.iter().any(|(younger, as_before)| key == *younger && value.as_f64() == Some(*as_before))
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
    use crate::config::{Pipeline, Preset, Source, Stage};
    use crate::task::built_in::stack;
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

    #[test]
    fn a_key_that_an_older_version_lacked_is_no_difference_as_long_as_it_says_how_that_acted() {
        let defaults = Pipeline::load(&Source::BuiltIn(stack().into(), Preset::Best), &[]).expect("settings");
        for (key, as_before) in YOUNGER {
            let section = key.split('.').next().expect("a section");
            let stage = Stage::ALL.into_iter().find(|stage| stage.sections().contains(&section)).expect("a stage reads it");
            let ours = Provenance::new(stage.name(), "stack", defaults.to_json(stage).expect("JSON"), 1);
            let path = format!("/{}", key.replace('.', "/"));
            let (table, name) = path.rsplit_once('/').expect("a path");
            assert_eq!(
                ours.settings.pointer(&path).and_then(Value::as_f64),
                Some(as_before),
                "{key}: preset best acts as before"
            );
            let (mut older, mut other) = (ours.clone(), ours.clone());
            older.settings.pointer_mut(table).and_then(Value::as_object_mut).expect("a table").remove(name);
            *other.settings.pointer_mut(&path).expect("the value") = json!(0.125);
            assert_eq!((first_difference(&older, &ours), first_difference(&ours, &older)), (None, None), "{key}");
            let said = first_difference(&older, &other).map(|found| found.to_string());
            assert_eq!(said, Some(format!("{key} was \"missing\", now it is 0.125")));
        }
    }
}
