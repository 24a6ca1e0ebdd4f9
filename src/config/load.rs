//! From a preset or a pipeline file and `--set` words to a checked [`Pipeline`].

use super::pipeline_file::{ROBOT, TASK, lay_over, parsed, read_table};
use super::ranges::Range;
use super::robot::is_file;
use super::{ChosenTask, Pipeline, Preset, ProjectFile, check};
use crate::error::{Error, Result};
use crate::words::shown;
use std::path::PathBuf;

/// Parts of a dotted key: stage, sections, key.
const MOST_PARTS: usize = 4;

/// Where settings come from before `--set` and flags.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// A preset that comes with hilt, for a task.
    BuiltIn(ChosenTask, Preset),
    /// A pipeline file; its task must be the given one, if one is given.
    File(PathBuf, Option<ChosenTask>),
}

impl Pipeline {
    /// Reads, overrides and checks the settings: defaults < `source` < `sets` (each `stage.key=value`, in order).
    ///
    /// # Errors
    /// [`Error::Usage`] names an unknown key and the nearest known one, or a key, its value and what is allowed;
    /// [`Error::Io`] when the file cannot be read.
    pub fn load(source: &Source, sets: &[String]) -> Result<Pipeline> {
        Pipeline::load_with(source, None, sets)
    }

    /// The same with the sections of a `project` file over those of `source`.
    ///
    /// # Errors
    /// As [`Pipeline::load`].
    pub fn load_with(source: &Source, project: Option<&ProjectFile>, sets: &[String]) -> Result<Pipeline> {
        let (origin, mut own, task) = match source {
            Source::BuiltIn(task, preset) => {
                let origin = format!("built-in pipeline {} ({})", task.name, preset.name());
                let mut own = parsed(preset.text(&task.name), &origin)?;
                own.remove(TASK);
                (origin, own, Some(task))
            }
            Source::File(path, task) => (path.display().to_string(), read_table(path)?, task.as_ref()),
        };
        agree_on_task(&mut own, task, &origin)?;
        let mut table = extended(own, &origin)?;
        let mut pipeline = check::resolve(table.clone(), &origin)?;
        if let Some(project) = project {
            lay_over(&mut table, project.settings.clone());
            pipeline = check::resolve(table.clone(), &project.path.display().to_string())?;
        }
        for set in sets {
            let origin = format!("--set {}", shown(set));
            put(&mut table, set, &origin)?;
            pipeline = check::resolve(table.clone(), &origin)?;
        }
        Ok(pipeline)
    }
}

/// The settings of the preset that a file `extends`, with the file's own over them. A preset may extend another.
pub(super) fn extended(mut own: toml::Table, origin: &str) -> Result<toml::Table> {
    let Some(name) = own.remove("extends") else {
        return Ok(own);
    };
    let refuse = |why: String| Error::Usage(format!("{origin}: extends: {why}"));
    let name = name.as_str().ok_or_else(|| refuse(format!("{} is no preset's name in quotes", shown(&name.to_string()))))?;
    let preset: Preset = name.parse().map_err(refuse)?;
    let Some(task) = name_of(&own) else {
        return Ok(own); // what is wrong with the task is said where the settings are checked
    };
    let mut of_preset = parsed(preset.text(&task), preset.name())?;
    of_preset.entry(TASK).or_insert_with(|| task.into());
    let mut table = extended(of_preset, preset.name())?;
    table.remove(TASK);
    lay_over(&mut table, own);
    Ok(table)
}

/// The name of the task that a table says.
fn name_of(table: &toml::Table) -> Option<String> {
    match table.get(TASK)? {
        toml::Value::String(said) if is_file(said) => ChosenTask::read(said).ok().map(|task| task.name.clone()),
        toml::Value::String(name) => Some(name.clone()),
        said => said.get("name")?.as_str().map(String::from),
    }
}

/// The file's task and the asked one must be the same; either may be missing, not both.
fn agree_on_task(table: &mut toml::Table, asked: Option<&ChosenTask>, origin: &str) -> Result<()> {
    match (table.contains_key(TASK), asked) {
        (false, None) => Err(Error::Usage(format!("{origin} names no task: add task = \"pick-up\" to its top, or give --task"))),
        (false, Some(asked)) => {
            let said = toml::Value::try_from(asked).map_err(|e| Error::Usage(format!("{origin}: the task: {e}")))?;
            table.insert(TASK.into(), said);
            Ok(())
        }
        (true, Some(asked)) => match name_of(table) {
            Some(named) if named != asked.name => Err(Error::Usage(format!(
                "{origin} is for task {}, but --task {} is asked for: give only one, or the same",
                shown(&named),
                asked.name
            ))),
            _ => Ok(()),
        },
        (true, None) => Ok(()),
    }
}

/// Puts one `stage.key=value` into the table. The value is TOML; what is not TOML is taken as text.
pub(super) fn put(table: &mut toml::Table, set: &str, origin: &str) -> Result<()> {
    let refuse = |why: String| Err(Error::Usage(format!("{origin}: {why}")));
    let Some((key, value)) = set.split_once('=') else {
        return refuse("expected stage.key=value, for example --set plan.speed=0.5".into());
    };
    let (key, value) = (key.trim(), value.trim());
    let count = key.split('.').count();
    if count > MOST_PARTS {
        return refuse(format!("a key of {count} parts; none has more than {MOST_PARTS} (`hilt settings` prints all keys)"));
    }
    if key == TASK {
        return refuse(format!("the task is no setting: --task {} chooses it", shown(value)));
    }
    let parts: Vec<&str> = key.split('.').collect();
    if parts.len() < 2 && key != ROBOT || parts.iter().any(|p| p.is_empty()) {
        return refuse(format!("\"{}\" is not a key of the form stage.key{}", shown(key), check::hint(key)));
    }
    let value = match parse_value(value) {
        Ok(value) => value,
        Err(why) => return refuse(format!("{key} = {}: {}", shown(value), why.words(key))),
    };
    let (last, sections) = parts.split_last().expect("a key has parts");
    let mut at = table;
    for section in sections {
        let entry = at.entry(*section).or_insert_with(|| toml::Value::Table(toml::Table::new()));
        let Some(inner) = entry.as_table_mut() else {
            return refuse(format!("{section} is a value, not a section{}", check::hint(key)));
        };
        at = inner;
    }
    at.insert((*last).to_string(), value);
    Ok(())
}

/// Why a value is none.
enum NoValue {
    /// A number that no 64-bit number holds.
    TooLarge,
    /// It begins like a list, a table or a quoted text, but does not go on like one.
    NotToml(String),
}

impl NoValue {
    fn words(self, key: &str) -> String {
        match self {
            NoValue::TooLarge => {
                let allowed = Range::of(key).map_or(String::new(), |range| format!("; allowed: {range}"));
                format!("out of range{allowed}")
            }
            NoValue::NotToml(why) => format!("not valid TOML: {why}"),
        }
    }
}

fn parse_value(text: &str) -> std::result::Result<toml::Value, NoValue> {
    // A document of one line holds exactly one value: a line break or a comment would smuggle in more.
    match format!("value = {text}").parse::<toml::Table>() {
        Ok(mut table) if table.len() == 1 => Ok(table.remove("value").unwrap_or_else(|| text.into())),
        Err(_) if is_integer(text) || text.parse().is_ok_and(f64::is_infinite) => Err(NoValue::TooLarge),
        Err(why) if text.starts_with(['[', '{', '"', '\'']) => Err(NoValue::NotToml(why.message().into())),
        _ => Ok(text.into()),
    }
}

fn is_integer(text: &str) -> bool {
    let digits = text.trim_start_matches(['+', '-']);
    !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit())
}
