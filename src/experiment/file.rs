//! An experiment's file, checked: `pipelines/experiments/NAME.toml`.

use super::seeds::Seeds;
use crate::config::{Preset, Stage};
use crate::error::{Error, Result};
use crate::learn::Method;
use crate::tasks::Task;
use crate::words::{did_you_mean, shown, unknown};
use serde::Deserialize;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Where the experiments that come with hilt are.
pub const DIRECTORY: &str = "pipelines/experiments";
/// A file with every key has a few kB \[bytes\].
const LONGEST_FILE: u64 = 1 << 20;
/// A directory's name is shorter than 256 bytes everywhere; nobody types so many.
const LONGEST_NAME: usize = 64;
/// Keys of an experiment.
const KEYS: [&str; 10] =
    ["description", "tasks", "presets", "methods", "seeds", "episodes", "set", "dataset", "record", "variation"];
/// Keys of a variation.
const VARIATION_KEYS: [&str; 6] = ["name", "extends", "set", "stages", "tasks", "methods"];
/// Names of files and directories that stand where the name of a variation would.
const TAKEN: [&str; 6] = ["plans", "recordings", "dataset", "dynamics", "logs", "rollouts"];

/// What an experiment's file says, with names in place of words.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// The file's name without its ending: the name of the directory of its runs.
    pub name: String,
    /// The file.
    pub path: PathBuf,
    /// What it is for.
    pub description: String,
    /// Tasks.
    pub tasks: Vec<Task>,
    /// Presets: those that come with hilt, or directories below `pipelines` with a file a task.
    pub presets: Vec<String>,
    /// Methods.
    pub methods: Vec<Method>,
    /// Seeds.
    pub seeds: Vec<u64>,
    /// Episodes of each evaluation, if not those of the preset.
    pub episodes: Option<u64>,
    /// Settings of all runs, over those of the preset.
    pub set: Vec<String>,
    /// Datasets to learn from instead of own demos; `{task}` and `{seed}` stand for those of a run.
    pub dataset: Option<String>,
    /// Whether evaluations are recorded, as `rollouts/`.
    pub record: bool,
    /// Variations; none = the plain settings.
    pub variations: Vec<Variation>,
}

/// A named change of settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Variation {
    /// Its name, a directory's.
    pub name: String,
    /// Settings, over all others.
    pub set: Vec<String>,
    /// Stages that they hold for.
    pub stages: Vec<Stage>,
    /// Tasks that have it.
    pub tasks: Vec<Task>,
    /// Methods that have it.
    pub methods: Vec<Method>,
}

/// What the command line says instead of the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overrides {
    /// Seeds.
    pub seeds: Option<Vec<u64>>,
    /// Episodes of each evaluation.
    pub episodes: Option<u64>,
}

#[derive(Deserialize)]
struct Raw {
    #[serde(default)]
    description: String,
    tasks: Vec<String>,
    #[serde(default)]
    presets: Option<Vec<String>>,
    methods: Vec<String>,
    seeds: Seeds,
    episodes: Option<u64>,
    #[serde(default)]
    set: Vec<String>,
    dataset: Option<String>,
    #[serde(default)]
    record: bool,
    #[serde(default)]
    variation: Vec<RawVariation>,
}

#[derive(Deserialize)]
struct RawVariation {
    name: String,
    /// An earlier variation, whose settings come first.
    extends: Option<String>,
    #[serde(default)]
    set: Vec<String>,
    stages: Option<Vec<String>>,
    tasks: Option<Vec<String>>,
    methods: Option<Vec<String>>,
}

/// The file of an experiment: the path of a `.toml` file, or the name of one in [`DIRECTORY`].
///
/// # Errors
/// [`Error::Usage`] when there is no such experiment, with the nearest name.
pub fn find(name: &str) -> Result<PathBuf> {
    if name.ends_with(".toml") {
        return Ok(name.into());
    }
    let path = Path::new(DIRECTORY).join(format!("{name}.toml"));
    if is_name(name) && path.is_file() {
        return Ok(path);
    }
    let known: BTreeSet<String> = fs::read_dir(DIRECTORY)
        .into_iter()
        .flatten()
        .flatten()
        .filter_map(|entry| Some(entry.file_name().to_str()?.strip_suffix(".toml")?.to_string()))
        .collect();
    if known.is_empty() {
        let message =
            format!("no experiment \"{}\": there is no {DIRECTORY} here; name a file, for example mine.toml", shown(name));
        return Err(Error::Usage(message));
    }
    let known: Vec<&str> = known.iter().map(String::as_str).collect();
    Err(Error::Usage(unknown("experiment", name, &known)))
}

impl Experiment {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// [`Error::Io`] when it cannot be read; [`Error::Usage`] names what is wrong in it and what is allowed.
    pub fn read(path: &Path, overrides: &Overrides) -> Result<Self> {
        let io = |e| Error::io(path, "read", e);
        if fs::metadata(path).map_err(io)?.len() > LONGEST_FILE {
            return Err(Error::Usage(format!("{}: longer than {LONGEST_FILE} bytes: no experiment", path.display())));
        }
        let bytes = fs::read(path).map_err(io)?;
        let text = String::from_utf8(bytes).map_err(|_| Error::Usage(format!("{}: not UTF-8 text", path.display())))?;
        Experiment::parse(path, &text, overrides)
    }

    /// Of the text of a file.
    ///
    /// # Errors
    /// As [`Experiment::read`].
    pub fn parse(path: &Path, text: &str, overrides: &Overrides) -> Result<Self> {
        let name = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
        of_text(name, path, text, overrides).map_err(|why| Error::Usage(format!("{}: {why}", path.display())))
    }
}

fn of_text(name: &str, path: &Path, text: &str, overrides: &Overrides) -> std::result::Result<Experiment, String> {
    check_name("the experiment", name)?;
    let table: toml::Table =
        text.parse().map_err(|e: toml::de::Error| format!("not valid TOML: {}", e.to_string().trim_end()))?;
    check_keys(&table, &KEYS)?;
    if let Some(variations) = table.get("variation").and_then(toml::Value::as_array) {
        variations.iter().filter_map(toml::Value::as_table).try_for_each(|v| check_keys(v, &VARIATION_KEYS))?;
    }
    let raw: Raw = serde_path_to_error::deserialize(toml::Value::Table(table)).map_err(|e| match e.path().to_string() {
        key if key == "." => e.inner().to_string().trim_end().to_string(),
        key => format!("{key}: {}", e.inner().to_string().trim_end()),
    })?;
    let seeds = overrides.seeds.clone().map_or_else(|| raw.seeds.all(), Ok)?;
    let presets = raw.presets.unwrap_or_else(|| vec![Preset::default().name().into()]);
    presets.iter().try_for_each(|preset| check_name("preset", preset))?;
    let mut experiment = Experiment {
        name: name.into(),
        path: path.into(),
        description: raw.description,
        tasks: parsed(&raw.tasks)?,
        methods: parsed(&raw.methods)?,
        presets,
        seeds,
        episodes: overrides.episodes.or(raw.episodes),
        set: raw.set,
        dataset: raw.dataset,
        record: raw.record,
        variations: Vec::new(),
    };
    for list in [("tasks", experiment.tasks.len()), ("methods", experiment.methods.len()), ("presets", experiment.presets.len())]
    {
        not_empty(list)?;
    }
    not_empty(("seeds", experiment.seeds.len()))?;
    distinct("tasks", &raw.tasks)?;
    distinct("methods", &raw.methods)?;
    distinct("presets", &experiment.presets)?;
    for variation in &raw.variation {
        let checked = variation.check(&experiment).map_err(|why| format!("variation \"{}\": {why}", shown(&variation.name)))?;
        experiment.variations.push(checked);
    }
    distinct("variations", &raw.variation.iter().map(|v| v.name.clone()).collect::<Vec<_>>())?;
    Ok(experiment)
}

impl RawVariation {
    fn check(&self, of: &Experiment) -> std::result::Result<Variation, String> {
        check_name("the name", &self.name)?;
        let method = Method::ALL.map(Method::name).contains(&self.name.as_str());
        if method || TAKEN.contains(&self.name.as_str()) {
            return Err("this name is taken by another directory of a run; choose another".into());
        }
        let stages = self.stages.as_ref().map_or(Ok(Stage::ALL.to_vec()), |words| parsed(words))?;
        let tasks = self.tasks.as_ref().map_or(Ok(of.tasks.clone()), |words| parsed(words))?;
        let methods = self.methods.as_ref().map_or(Ok(of.methods.clone()), |words| parsed(words))?;
        for list in [("stages", stages.len()), ("tasks", tasks.len()), ("methods", methods.len())] {
            not_empty(list)?;
        }
        let foreign = tasks.iter().filter(|t| !of.tasks.contains(t)).map(|t| format!("task {t}"));
        let foreign = foreign.chain(methods.iter().filter(|m| !of.methods.contains(m)).map(|m| format!("method {}", m.name())));
        if let Some(foreign) = foreign.into_iter().next() {
            return Err(format!("{foreign} is none of the experiment's; add it there too"));
        }
        let mut set = match &self.extends {
            Some(name) => earlier(name, of)?,
            None => Vec::new(),
        };
        set.extend(self.set.iter().cloned());
        Ok(Variation { name: self.name.clone(), set, stages, tasks, methods })
    }
}

/// The settings of a variation that stands before.
fn earlier(name: &str, of: &Experiment) -> std::result::Result<Vec<String>, String> {
    let found = of.variations.iter().find(|v| v.name == name).map(|v| v.set.clone());
    let known: Vec<&str> = of.variations.iter().map(|v| v.name.as_str()).collect();
    found.ok_or_else(|| format!("extends: {} (only those before it)", unknown("variation", name, &known)))
}

fn parsed<T: std::str::FromStr<Err = String>>(words: &[String]) -> std::result::Result<Vec<T>, String> {
    words.iter().map(|word| word.parse()).collect()
}

fn check_keys(table: &toml::Table, known: &[&str]) -> std::result::Result<(), String> {
    match table.keys().find(|key| !known.contains(&key.as_str())) {
        Some(key) if key.contains('.') || crate::config::Stage::ALL.iter().any(|stage| stage.name() == key) => {
            let hint = did_you_mean(key, known.iter().copied());
            Err(format!("unknown key \"{}\"{hint}; settings go into set = [\"stage.key=value\"]", shown(key)))
        }
        Some(key) => Err(unknown("key", key, known)),
        None => Ok(()),
    }
}

/// What can be a directory's name everywhere, also where letters have no case.
fn is_name(name: &str) -> bool {
    let letters = name.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b"._-".contains(&b));
    letters && name.starts_with(|c: char| c.is_ascii_alphanumeric()) && name.len() <= LONGEST_NAME
}

fn check_name(what: &str, name: &str) -> std::result::Result<(), String> {
    if is_name(name) {
        return Ok(());
    }
    let name = shown(name);
    Err(format!(
        "{what} \"{name}\" is no name of a directory: up to {LONGEST_NAME} small letters, digits, dots, - and _, a letter or digit first"
    ))
}

fn not_empty((list, len): (&str, usize)) -> std::result::Result<(), String> {
    if len == 0 { Err(format!("{list} are empty: there is nothing to run")) } else { Ok(()) }
}

fn distinct(list: &str, names: &[String]) -> std::result::Result<(), String> {
    let mut seen = BTreeSet::new();
    match names.iter().find(|name| !seen.insert(name.as_str())) {
        Some(twice) => Err(format!("{list}: \"{}\" is there twice", shown(twice))),
        None => Ok(()),
    }
}
