//! Words of an experiment's file: names, keys and lists, and what is wrong with them.

use super::spec::MethodSets;
use crate::config::{ChosenTask, Stage};
use crate::learn::MethodName;
use crate::words::{did_you_mean, shown, unknown};
use std::collections::{BTreeMap, BTreeSet};

/// A directory's name is shorter than 256 bytes everywhere; nobody types so many.
const LONGEST_NAME: usize = 64;

/// Why writing into a text cannot fail.
pub(super) const TAKES: &str = "a text takes all that is written to it";

pub(super) fn parsed<T: std::str::FromStr<Err = String>>(words: &[String]) -> std::result::Result<Vec<T>, String> {
    words.iter().map(|word| word.parse()).collect()
}

/// Settings of single methods: each one of `allowed`, and settings of `train` alone, whose artefacts are a method's own.
pub(super) fn method_sets(
    words: &BTreeMap<String, Vec<String>>,
    allowed: &[MethodName],
) -> std::result::Result<MethodSets, String> {
    let mut sets = MethodSets::new();
    for (word, set) in words {
        let method: MethodName = word.parse().map_err(|why| format!("method_set: {why}"))?;
        if !allowed.contains(&method) {
            return Err(format!("method_set: method {word} is not among the methods; add it there too"));
        }
        if let Some(other) = set.iter().find(|set| !set.trim_start().starts_with("train.")) {
            let why = "allowed: settings of train, for what comes before is shared by methods";
            return Err(format!("method_set: \"{}\" of {word}; {why}", shown(other)));
        }
        sets.insert(method, set.clone());
    }
    Ok(sets)
}

/// Names of tasks, each of one that there is: with hilt, or in a file.
pub(super) fn task_names(words: &[String]) -> std::result::Result<Vec<String>, String> {
    words.iter().map(|word| ChosenTask::read(word).map(|task| task.name.clone())).collect()
}

pub(super) fn check_keys(table: &toml::Table, known: &[&str]) -> std::result::Result<(), String> {
    match table.keys().find(|key| !known.contains(&key.as_str())) {
        Some(key) if key.contains('.') || Stage::ALL.iter().any(|stage| stage.name() == key) => {
            let hint = did_you_mean(key, known.iter().copied());
            Err(format!("unknown key \"{}\"{hint}; settings go into set = [\"stage.key=value\"]", shown(key)))
        }
        Some(key) => Err(unknown("key", key, known)),
        None => Ok(()),
    }
}

/// What can be a directory's name everywhere, also where letters have no case.
pub(super) fn is_name(name: &str) -> bool {
    let letters = name.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b"._-".contains(&b));
    letters && name.starts_with(|c: char| c.is_ascii_alphanumeric()) && name.len() <= LONGEST_NAME
}

pub(super) fn check_name(what: &str, name: &str) -> std::result::Result<(), String> {
    if is_name(name) {
        return Ok(());
    }
    let name = shown(name);
    Err(format!(
        "{what} \"{name}\" is no name of a directory: up to {LONGEST_NAME} small letters, digits, dots, - and _, a letter or digit first"
    ))
}

pub(super) fn not_empty((list, len): (&str, usize)) -> std::result::Result<(), String> {
    if len == 0 { Err(format!("{list} are empty: there is nothing to run")) } else { Ok(()) }
}

pub(super) fn distinct(list: &str, names: &[String]) -> std::result::Result<(), String> {
    let mut seen = BTreeSet::new();
    match names.iter().find(|name| !seen.insert(name.as_str())) {
        Some(twice) => Err(format!("{list}: \"{}\" is there twice", shown(twice))),
        None => Ok(()),
    }
}
