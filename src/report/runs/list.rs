//! Many runs beside each other: a row a policy or an evaluation, with the settings in which they differ.

use super::artefacts::{Artefact, artefacts, is_run};
use super::run::method_of;
use super::standing::file_name;
use crate::config::Stage;
use crate::data::differences::flattened;
use crate::data::{Provenance, dataset, json_file, weights};
use crate::error::{Error, Result};
use crate::eval::Summary;
use crate::experiment::estimate::wall_s_of;
use crate::interrupt::Interrupt;
use serde::Serialize;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Directories below the one that is asked for; an experiment's runs are five below its own.
const DEEPEST: usize = 8;
/// Directories above a run that may hold its demos.
const ABOVE: usize = 3;

/// A policy, its evaluation, or both.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Directory below the one that was asked for, with the file's name where the directory holds several.
    pub run: String,
    /// The task.
    pub task: String,
    /// The robot, where it is not the paper's.
    pub robot: Option<String>,
    /// hil, bc, ..., "planner", or what else was evaluated.
    pub method: String,
    /// Of the evaluation, else of the training.
    pub seed: u64,
    /// Demonstrations, training and validation.
    pub demos: Option<usize>,
    /// The evaluation's answer.
    pub summary: Option<Summary>,
    /// Wall time of all stages in the directory by their logs, those of other methods aside \[s\].
    pub wall_s: Option<f64>,
    /// All settings by their dotted keys.
    #[serde(skip)]
    pub settings: BTreeMap<String, Value>,
}

/// All runs below `dir`, the best of each task first.
///
/// # Errors
/// [`Error::Input`] when there are none; [`Error::Io`] when a directory cannot be read; [`Error::Interrupted`].
pub fn list(dir: &Path, interrupt: &Interrupt) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    below(dir, dir, DEEPEST, &mut rows, interrupt)?;
    if rows.is_empty() {
        let message =
            "holds no run: no policy and no evaluation of hilt below it; make all TASK=stack makes one under runs/stack";
        return Err(Error::input(dir, message));
    }
    let rate = |row: &Row| row.summary.as_ref().map_or(-1.0, |summary| summary.success_rate);
    rows.sort_by(|a, b| a.task.cmp(&b.task).then(rate(b).total_cmp(&rate(a))).then_with(|| a.run.cmp(&b.run)));
    Ok(rows)
}

fn below(root: &Path, dir: &Path, depth: usize, rows: &mut Vec<Row>, interrupt: &Interrupt) -> Result<()> {
    interrupt.check()?;
    if is_run(dir) {
        rows.extend(rows_of(root, dir)?);
    }
    let entries = fs::read_dir(dir).map_err(|e| Error::io(dir, "read", e))?;
    let is_place = |path: &PathBuf| {
        let name = file_name(path);
        !name.starts_with('.') && !["recordings", "dataset", "logs", "settings"].contains(&name.as_str())
    };
    let real = entries.filter_map(|entry| entry.ok()).filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir()));
    let mut inner: Vec<PathBuf> = real.map(|entry| entry.path()).filter(is_place).collect();
    inner.sort();
    match depth.checked_sub(1) {
        Some(depth) => inner.iter().try_for_each(|inner| below(root, inner, depth, rows, interrupt)),
        None => Ok(()),
    }
}

/// The policies and evaluations right in `dir`: an evaluation and its policy are one row.
fn rows_of(root: &Path, dir: &Path) -> Result<Vec<Row>> {
    let found = artefacts(dir)?;
    let of = |stage: Stage| found.iter().filter(move |artefact| artefact.stage == stage);
    // What cannot be read is told by `hilt inspect`; a damaged file keeps no other from the table.
    let policies: Vec<(&Artefact, Provenance, String)> = of(Stage::Train)
        .filter_map(|policy| {
            let (.., made, content) = weights::read_hashed(&policy.path, weights::POLICY).ok()?;
            Some((policy, made, content.to_string()))
        })
        .collect();
    let evaluations: Vec<(&Artefact, Summary, Provenance)> = of(Stage::Evaluate)
        .filter_map(|evaluation| {
            let (content, made) = json_file::read(&evaluation.path).ok()?;
            Some((evaluation, serde_json::from_value(content).ok()?, made))
        })
        .collect();
    let several = policies.len() > 1 || evaluations.len() > 1;
    let place = dir.strip_prefix(root).unwrap_or(dir).display().to_string();
    let place = if place.is_empty() { ".".to_string() } else { place };
    let named = |path: &Path| if several { format!("{place}/{}", file_name(path)) } else { place.clone() };
    let mut rows = Vec::new();
    let mut used = BTreeSet::new();
    for (evaluation, summary, judged) in &evaluations {
        let policy = policies.iter().find(|(.., content)| judged.inputs.get("policy") == Some(content));
        used.extend(policy.map(|(policy, ..)| policy.path.clone()));
        let trained = policy.map(|(_, made, _)| made);
        let method = trained.and_then(|made| made.settings["method"].as_str()).map(String::from);
        let method = method.unwrap_or_else(|| method_of(&evaluation.path, judged));
        rows.push(row(dir, named(&evaluation.path), method, trained, Some((summary, judged))));
    }
    for (policy, made, _) in policies.iter().filter(|(policy, ..)| !used.contains(&policy.path)) {
        let method = made.settings["method"].as_str().unwrap_or("policy").to_string();
        rows.push(row(dir, named(&policy.path), method, Some(made), None));
    }
    Ok(rows)
}

fn row(dir: &Path, run: String, method: String, trained: Option<&Provenance>, judged: Option<(&Summary, &Provenance)>) -> Row {
    let made = judged.map(|(_, made)| made).or(trained).expect("a row is of a policy or of an evaluation");
    let mut settings = BTreeMap::new();
    let above: Vec<&Path> = dir.ancestors().take(ABOVE + 1).collect();
    let datasets = above.iter().map(|above| above.join("dataset").join(dataset::TRAIN)).find(|root| root.join("meta").is_dir());
    let converted = datasets.as_ref().and_then(|root| dataset::provenance(root).ok());
    for made in [converted.as_ref(), trained, judged.map(|(_, made)| made)].into_iter().flatten() {
        // Where the evaluation differs from the training, the reader wants to know both.
        let clash = |key: &String| made.stage == Stage::Evaluate.name() && settings.contains_key(key);
        let all: Vec<(String, Value)> = flattened(&made.settings).into_iter().filter(|(key, _)| told(key)).collect();
        let new: Vec<(String, Value)> = all
            .into_iter()
            .filter_map(|(key, value)| match settings.get(&key) {
                Some(known) if clash(&key) && *known != value => Some((format!("evaluated.{key}"), value)),
                Some(_) => None,
                None => Some((key, value)),
            })
            .collect();
        settings.extend(new);
    }
    Row {
        run,
        task: made.task.clone(),
        robot: made.settings["robot"]["name"].as_str().map(String::from),
        seed: made.seed,
        demos: trained.filter(|made| made.inputs.contains_key("dataset")).and(datasets).and_then(|root| demos(&root)),
        summary: judged.map(|(summary, _)| summary.clone()),
        wall_s: wall_s(dir, &method),
        method,
        settings,
    }
}

/// Whether a key is told among differences: what has a column of its own is not, nor is what only says what a policy is.
fn told(key: &str) -> bool {
    let part = key.split('.').next().unwrap_or(key);
    !["method", "robot", "task", "policy"].contains(&part) && key != "evaluate.horizon_steps"
}

fn demos(train: &Path) -> Option<usize> {
    let validation = train.with_file_name(dataset::VALIDATION);
    let of = |root: &Path| dataset::episodes(root).ok();
    Some(of(train)? + of(&validation).unwrap_or(0))
}

/// Of all stages whose logs stand in the run or in the experiment's; `None` where there is none.
fn wall_s(dir: &Path, method: &str) -> Option<f64> {
    let suffixed = |stage: Stage| {
        let of_method = matches!(stage, Stage::Train | Stage::Evaluate) && method != "hil";
        if of_method { format!("{}-{method}.log", stage.name()) } else { format!("{}.log", stage.name()) }
    };
    let of_experiment = dir.ancestors().skip(1).take(DEEPEST).find_map(|root| {
        let way = dir.strip_prefix(root).ok()?;
        let logs = root.join("logs");
        logs.join(way).is_dir().then_some(logs.join(way))
    });
    let times: Vec<f64> = match of_experiment {
        // Shared steps stand above: demos are made once for several methods.
        Some(logs) => {
            let own = Stage::ALL.iter().filter_map(|stage| wall_s_of(&logs.join(format!("{}.log", stage.name()))));
            let shared = |stage: &Stage| {
                let mut above = logs.ancestors().skip(1).take(ABOVE);
                above.find_map(|above| wall_s_of(&above.join(format!("{}.log", stage.name()))))
            };
            own.chain(Stage::ALL.iter().filter(|stage| (**stage as usize) < Stage::Train as usize).filter_map(shared)).collect()
        }
        None => Stage::ALL.iter().filter_map(|stage| wall_s_of(&dir.join("logs").join(suffixed(*stage)))).collect(),
    };
    (!times.is_empty()).then(|| times.iter().sum())
}
