//! From a preset or a pipeline file and `--set` words to a checked [`Pipeline`].

use super::{Pipeline, check};
use crate::error::{Error, Result};
use crate::interrupt;
use crate::tasks::Task;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// The pipeline files that the binary carries, so that it works from any directory.
const BUILT_IN: [(Task, Preset, &str); 6] = [
    (Task::PickUp, Preset::Best, include_str!("../../pipelines/pick-up.toml")),
    (Task::PickAndPlace, Preset::Best, include_str!("../../pipelines/pick-and-place.toml")),
    (Task::Stack, Preset::Best, include_str!("../../pipelines/stack.toml")),
    (Task::PickUp, Preset::Paper, include_str!("../../pipelines/paper/pick-up.toml")),
    (Task::PickAndPlace, Preset::Paper, include_str!("../../pipelines/paper/pick-and-place.toml")),
    (Task::Stack, Preset::Paper, include_str!("../../pipelines/paper/stack.toml")),
];

/// Which of the two sets of settings that come with hilt.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Preset {
    /// The method with every documented mend switched on.
    #[default]
    Best,
    /// As literal as can work.
    Paper,
}

impl Preset {
    /// All presets.
    pub const ALL: [Preset; 2] = [Preset::Best, Preset::Paper];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        ["best", "paper"][self as usize]
    }
}

impl FromStr for Preset {
    type Err = String;

    fn from_str(s: &str) -> std::result::Result<Self, String> {
        Preset::ALL
            .into_iter()
            .find(|p| p.name() == s)
            .ok_or_else(|| format!("unknown preset \"{s}\"; allowed: {}", Preset::ALL.map(Preset::name).join(", ")))
    }
}

/// Where settings come from before `--set` and flags.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// A preset that comes with hilt.
    BuiltIn(Task, Preset),
    /// A pipeline file; its task must be the given one, if one is given.
    File(PathBuf, Option<Task>),
}

impl Pipeline {
    /// Reads, overrides and checks the settings: defaults < `source` < `sets` (each `stage.key=value`, in order).
    ///
    /// # Errors
    /// [`Error::Usage`] names an unknown key and the nearest known one, or a key, its value and what is allowed;
    /// [`Error::Io`] when the file cannot be read.
    pub fn load(source: &Source, sets: &[String]) -> Result<Pipeline> {
        let (origin, text, task) = match source {
            Source::BuiltIn(task, preset) => {
                let (.., text) = BUILT_IN
                    .iter()
                    .find(|(t, p, _)| t == task && p == preset)
                    .expect("every task has a built-in pipeline for every preset");
                (format!("built-in pipeline {task} ({})", preset.name()), (*text).to_string(), Some(*task))
            }
            Source::File(path, task) => (path.display().to_string(), read(path)?, *task),
        };
        let mut table: toml::Table = text
            .parse()
            .map_err(|e: toml::de::Error| Error::Usage(format!("{origin} is not valid TOML: {}", e.to_string().trim_end())))?;
        agree_on_task(&mut table, task, &origin)?;
        let mut pipeline = check::resolve(table.clone(), &origin)?;
        for set in sets {
            apply(&mut table, set)?;
            pipeline = check::resolve(table.clone(), &format!("--set {set}"))?;
        }
        Ok(pipeline)
    }
}

fn read(path: &Path) -> Result<String> {
    let _waits = interrupt::waiting();
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, "read", e))?;
    String::from_utf8(bytes).map_err(|_| Error::Usage(format!("{} is not a pipeline file: it is not UTF-8 text", path.display())))
}

/// The file's task and the asked one must be the same; either may be missing, not both.
fn agree_on_task(table: &mut toml::Table, asked: Option<Task>, origin: &str) -> Result<()> {
    match (table.get("task").and_then(toml::Value::as_str), asked) {
        (None, None) if !table.contains_key("task") => {
            Err(Error::Usage(format!("{origin} names no task: add task = \"pick-up\" to its top, or give --task")))
        }
        (Some(named), Some(asked)) if named != asked.name() => Err(Error::Usage(format!(
            "{origin} is for task {named}, but --task {asked} is asked for: give only one, or the same"
        ))),
        (None, Some(asked)) if !table.contains_key("task") => {
            table.insert("task".into(), asked.name().into());
            Ok(())
        }
        _ => Ok(()),
    }
}

/// Puts one `stage.key=value` into the table. The value is TOML; what is not TOML is taken as text.
fn apply(table: &mut toml::Table, set: &str) -> Result<()> {
    let Some((key, value)) = set.split_once('=') else {
        return Err(Error::Usage(format!("--set {set}: expected stage.key=value, for example --set plan.speed=0.5")));
    };
    let (key, value) = (key.trim(), value.trim());
    let parts: Vec<&str> = key.split('.').collect();
    if parts.len() < 2 || parts.iter().any(|p| p.is_empty()) {
        let hint = check::nearest(key).map_or(String::new(), |known| format!("; did you mean {known}?"));
        return Err(Error::Usage(format!("--set {set}: \"{key}\" is not a key of the form stage.key{hint}")));
    }
    let value = parse_value(value);
    let (last, sections) = parts.split_last().expect("a key has at least two parts");
    let mut at = table;
    for section in sections {
        let entry = at.entry(*section).or_insert_with(|| toml::Value::Table(toml::Table::new()));
        at = entry.as_table_mut().ok_or_else(|| {
            let hint = check::nearest(key).map_or(String::new(), |known| format!("; did you mean {known}?"));
            Error::Usage(format!("--set {set}: {section} is a value, not a section{hint}"))
        })?;
    }
    at.insert((*last).to_string(), value);
    Ok(())
}

fn parse_value(text: &str) -> toml::Value {
    // A document of one line holds exactly one value: a line break or a comment would smuggle in more.
    match format!("value = {text}").parse::<toml::Table>() {
        Ok(mut table) if table.len() == 1 => table.remove("value").unwrap_or_else(|| text.into()),
        _ => text.into(),
    }
}
