//! What each key means: the words beside its field, what is allowed, what the presets say, and what was measured.

use super::check::{hint, leaves};
use super::load::Source;
use super::ranges::Range;
use super::{ChosenTask, Pipeline, Preset};
use crate::error::{Error, Result};
use crate::task::built_in;
use schemars::SchemaGenerator;
use serde_json::Value;
use std::fmt;

/// A key, explained.
#[derive(Clone, Debug, PartialEq)]
pub struct Explained {
    /// `stage.key`.
    pub key: String,
    /// What it means, and its unit.
    pub words: String,
    /// What its values may be, with what each of a few names means.
    pub choices: Vec<(String, String)>,
    /// The range of its numbers, where it has one.
    pub allowed: Option<String>,
    /// Its value where nothing is said.
    pub default: String,
    /// What each preset says.
    pub presets: Vec<OfPreset>,
    /// What was measured of it, where something was.
    pub measured: Option<String>,
}

/// What was measured, a text a key.
const MEASURED: &str = include_str!("measured.toml");

/// What a preset says of a key.
#[derive(Clone, Debug, PartialEq)]
pub struct OfPreset {
    /// The preset.
    pub name: &'static str,
    /// Each value with its tasks.
    pub values: Vec<(String, Vec<String>)>,
}

/// Every key that is `asked`, or stands in a section that is; all of them where nothing is asked. The presets' values are those for `task`, or for the
/// paper's three.
///
/// # Errors
/// [`Error::Usage`] for a key that there is not, with the nearest that there is.
pub fn explain(asked: &str, task: Option<&ChosenTask>) -> Result<Vec<Explained>> {
    let schema = SchemaGenerator::default().into_root_schema_for::<Pipeline>().to_value();
    let defaults = Pipeline::defaults(&built_in::pick_up());
    let tasks = match task {
        Some(task) => vec![task.clone()],
        None => built_in::of_the_paper().into_iter().map(ChosenTask::from).collect(),
    };
    let loaded = |preset: Preset| -> Result<Vec<(String, toml::Table)>> {
        let of = |task: &ChosenTask| {
            let pipeline = Pipeline::load(&Source::BuiltIn(task.clone(), preset), &[])?;
            Ok((task.name.clone(), pipeline.to_table()?))
        };
        tasks.iter().map(of).collect()
    };
    let presets = Preset::ALL.into_iter().map(|preset| Ok((preset.name(), loaded(preset)?))).collect::<Result<Vec<_>>>()?;
    let is_asked =
        |key: &str| asked.is_empty() || key == asked || key.strip_prefix(asked).is_some_and(|rest| rest.starts_with('.'));
    let sections = defaults.to_table()?;
    // A task is a file of its own, and explained by docs/add-a-task.md.
    let keys = leaves(&sections).into_iter().filter(|(key, _)| key.contains('.') && is_asked(key));
    let measured = measured();
    let all: Vec<Explained> = keys.map(|(key, default)| explained((&schema, &measured), &key, &default, &presets)).collect();
    if all.is_empty() {
        let hint = hint(asked);
        return Err(Error::Usage(format!("--explain {asked}: unknown key{hint} (`hilt settings --explain` explains all keys)")));
    }
    Ok(all)
}

fn explained(
    (schema, measured): (&Value, &[(String, String)]),
    key: &str,
    default: &toml::Value,
    presets: &[(&'static str, Vec<(String, toml::Table)>)],
) -> Explained {
    let (words, choices) = meaning(schema, key);
    let values = |tables: &[(String, toml::Table)]| {
        let mut values: Vec<(String, Vec<String>)> = Vec::new();
        for (task, table) in tables {
            let value =
                leaves(table).into_iter().find(|(k, _)| k == key).map_or_else(String::new, |(_, value)| value.to_string());
            match values.iter_mut().find(|(known, _)| *known == value) {
                Some((_, tasks)) => tasks.push(task.clone()),
                None => values.push((value, vec![task.clone()])),
            }
        }
        values
    };
    Explained {
        key: key.into(),
        words,
        choices,
        allowed: Range::of(key).map(|range| range.to_string()),
        default: default.to_string(),
        presets: presets.iter().map(|(name, tables)| OfPreset { name, values: values(tables) }).collect(),
        measured: measured.iter().find_map(|(of, text)| (of == key).then(|| text.clone())),
    }
}

fn measured() -> Vec<(String, String)> {
    let table: toml::Table = MEASURED.parse().expect("measured.toml is TOML");
    let text = |value: toml::Value| value.as_str().expect("measured.toml holds texts").to_string();
    leaves(&table).into_iter().map(|(key, value)| (key, text(value))).collect()
}

/// The words beside the field of `key`, and the names that its values may have, with their words.
fn meaning(schema: &Value, key: &str) -> (String, Vec<(String, String)>) {
    let mut at = schema;
    let mut words = String::new();
    for part in key.split('.') {
        let property = &at["properties"][part];
        words = words_of(property);
        at = resolved(schema, property);
    }
    let one_of = at["oneOf"].as_array().or_else(|| at["anyOf"].as_array()).into_iter().flatten();
    let choices = one_of.filter_map(|one| Some((format!("\"{}\"", one["const"].as_str()?), words_of(one)))).collect();
    (words, choices)
}

/// What a `$ref` names.
fn resolved<'a>(schema: &'a Value, property: &'a Value) -> &'a Value {
    let named = property["$ref"].as_str().and_then(|name| name.strip_prefix('#'));
    named.and_then(|pointer| schema.pointer(pointer)).unwrap_or(property)
}

/// A doc comment as plain words: lines joined, no marks of Markdown.
fn words_of(schema: &Value) -> String {
    let text = schema["description"].as_str().unwrap_or_default();
    text.split_whitespace().collect::<Vec<_>>().join(" ").replace("\\[", "[").replace("\\]", "]").replace('`', "")
}

impl fmt::Display for Explained {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}\n  {}", self.key, self.words)?;
        self.choices.iter().try_for_each(|(name, words)| writeln!(f, "    {name}: {words}"))?;
        if let Some(allowed) = &self.allowed {
            writeln!(f, "  allowed: {allowed}")?;
        }
        writeln!(f, "  default: {}", self.default)?;
        for OfPreset { name, values } in &self.presets {
            let one = values.len() == 1;
            let said =
                values.iter().map(|(value, tasks)| if one { value.clone() } else { format!("{value} ({})", tasks.join(", ")) });
            writeln!(f, "  {name}: {}", said.collect::<Vec<_>>().join("; "))?;
        }
        self.measured.as_ref().map_or(Ok(()), |measured| writeln!(f, "  measured: {measured}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_has_words_a_default_and_a_value_in_every_preset() {
        let all = explain("", None).expect("explained");
        assert!(all.len() > 100, "{} keys", all.len());
        for one in &all {
            assert!(one.words.len() > 5 && !one.default.is_empty(), "{one:?}");
            assert!(one.presets.iter().all(|of| of.values.iter().all(|(value, _)| !value.is_empty())), "{one:?}");
            assert!(one.choices.iter().all(|(_, words)| !words.is_empty()), "{one:?}");
        }
        // Every number has a range, whatever its field is called.
        let numbers = all.iter().filter(|one| one.default.parse::<f64>().is_ok());
        assert_eq!(numbers.filter(|one| one.allowed.is_none()).map(|one| &one.key).collect::<Vec<_>>(), Vec::<&String>::new());
    }

    #[test]
    fn what_was_measured_is_told_of_keys_that_there_are() {
        let all = explain("", None).expect("explained");
        let unknown: Vec<String> =
            measured().into_iter().map(|(key, _)| key).filter(|key| all.iter().all(|one| one.key != *key)).collect();
        assert_eq!(unknown, [] as [&str; 0]);
        let [fingers] = &explain("train.sc.fingers", None).expect("explained")[..] else { panic!("one key") };
        assert!(fingers.to_string().contains("\n  measured: 100 demos, raw state: \"following\" 284"), "{fingers}");
    }

    #[test]
    fn a_key_says_what_stands_beside_it_and_where_the_presets_differ() {
        let [tau] = &explain("train.tau", None).expect("explained")[..] else { panic!("one key") };
        assert!(tau.words.starts_with("tau: error of the mean action"), "{tau}");
        let [features] = &explain("train.features", None).expect("explained")[..] else { panic!("one key") };
        let said = features.to_string();
        assert!(said.contains("\"fk-near\": Also the last two at close range"), "{said}");
        assert!(said.contains("\n  paper: \"raw\"\n"), "{said}");
        let [episodes] = &explain("plan.episodes", None).expect("explained")[..] else { panic!("one key") };
        assert!(episodes.to_string().contains("(stack)"), "{episodes}");
        assert!(explain("train.sc", None).expect("a section").len() > 5);
        let said = explain("train.ta", None).expect_err("unknown").to_string();
        assert!(said.contains("did you mean train.tau?"), "{said}");
    }
}
