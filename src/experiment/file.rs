//! An experiment's file, checked: `pipelines/experiments/NAME.toml`.

use super::report_kind::ReportKind;
use super::seeds::Seeds;
use super::spec::{Experiment, MethodSets, Overrides};
use super::variation::{self, Raw as RawVariation};
use super::wording::{check_keys, check_name, distinct, is_name, method_sets, not_empty, parsed, task_names};
use crate::config::Preset;
use crate::error::{Error, Result};
use crate::interrupt;
use crate::words::{shown, unknown};
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Where the experiments that come with hilt are.
pub const DIRECTORY: &str = "pipelines/experiments";
/// A file with every key has a few kB \[bytes\].
const LONGEST_FILE: u64 = 1 << 20;
/// Keys of an experiment.
const KEYS: [&str; 14] = [
    "description",
    "notes",
    "report",
    "reference",
    "tasks",
    "presets",
    "methods",
    "seeds",
    "episodes",
    "set",
    "method_set",
    "dataset",
    "record",
    "variation",
];

#[derive(Deserialize)]
struct Raw {
    #[serde(default)]
    description: String,
    #[serde(default)]
    notes: String,
    report: Option<String>,
    reference: Option<String>,
    tasks: Vec<String>,
    #[serde(default)]
    presets: Option<Vec<String>>,
    methods: Vec<String>,
    seeds: Seeds,
    episodes: Option<u64>,
    #[serde(default)]
    set: Vec<String>,
    #[serde(default)]
    method_set: BTreeMap<String, Vec<String>>,
    dataset: Option<String>,
    #[serde(default)]
    record: bool,
    #[serde(default)]
    variation: Vec<RawVariation>,
}

/// Names of the experiments in `pipelines/experiments`.
pub fn all() -> BTreeSet<String> {
    let entries = fs::read_dir(DIRECTORY).into_iter().flatten().flatten();
    entries.filter_map(|entry| Some(entry.file_name().to_str()?.strip_suffix(".toml")?.to_string())).collect()
}

/// The file of an experiment: the path of a `.toml` file, or the name of one in `pipelines/experiments`.
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
    let known = all();
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
        let bytes = interrupt::read_at_most(path, LONGEST_FILE).map_err(|e| Error::io(path, "read", e))?;
        if bytes.len() as u64 > LONGEST_FILE {
            return Err(Error::Usage(format!("{}: longer than {LONGEST_FILE} bytes: no experiment", path.display())));
        }
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
        variations.iter().filter_map(toml::Value::as_table).try_for_each(|v| check_keys(v, &variation::KEYS))?;
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
        notes: raw.notes,
        report: raw.report.map_or(Ok(ReportKind::default()), |word| word.parse())?,
        reference: raw.reference,
        tasks: task_names(&raw.tasks)?,
        said: raw.tasks,
        methods: parsed(&raw.methods)?,
        presets,
        seeds,
        episodes: overrides.episodes.or(raw.episodes),
        set: raw.set,
        method_set: MethodSets::new(),
        dataset: raw.dataset,
        record: raw.record,
        variations: Vec::new(),
    };
    for list in [("tasks", experiment.tasks.len()), ("methods", experiment.methods.len()), ("presets", experiment.presets.len())]
    {
        not_empty(list)?;
    }
    not_empty(("seeds", experiment.seeds.len()))?;
    distinct("tasks", &experiment.tasks)?;
    distinct("methods", &raw.methods)?;
    distinct("presets", &experiment.presets)?;
    experiment.method_set = method_sets(&raw.method_set, &experiment.methods)?;
    for variation in &raw.variation {
        let checked = variation.check(&experiment).map_err(|why| format!("variation \"{}\": {why}", shown(&variation.name)))?;
        experiment.variations.push(checked);
    }
    let names: Vec<String> = raw.variation.iter().map(|v| v.name.clone()).collect();
    distinct("variations", &names)?;
    if let Some(reference) = experiment.reference.as_ref().filter(|reference| !names.contains(reference)) {
        let known: Vec<&str> = names.iter().map(String::as_str).collect();
        return Err(format!("reference: {}", unknown("variation", reference, &known)));
    }
    Ok(experiment)
}
