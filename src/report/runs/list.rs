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
use crate::report::table::fitted_table;
use serde::Serialize;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Directories below the one that is asked for; an experiment's runs are five below its own.
const DEEPEST: usize = 8;
/// Directories above a run that may hold its demos.
const ABOVE: usize = 3;
/// The default of what no provenance says.
const DEFAULT: &str = "default";

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

/// Keys whose values are not the same in all rows, with those values, a row each; none of a single row.
fn differing(rows: &[Row]) -> Vec<(String, Vec<Option<Value>>)> {
    let keys: BTreeSet<&String> = rows.iter().flat_map(|row| row.settings.keys()).collect();
    let values = |key: &String| rows.iter().map(|row| row.settings.get(key).cloned()).collect::<Vec<_>>();
    let all = keys.into_iter().map(|key| (key.clone(), values(key)));
    // A key that a stage does not have (a planner has no train.rho) is no difference by itself.
    let differ = |values: &[Option<Value>]| {
        let mut known = values.iter().flatten();
        known.next().is_some_and(|first| known.any(|other| other != first))
    };
    all.filter(|(_, values)| differ(values)).collect()
}

/// For people: columns in which all rows are the same, and that say nothing, are left out.
pub fn to_text(rows: &[Row], width: Option<usize>) -> String {
    let differing = differing(rows);
    let optional = |name: &'static str, cells: Vec<String>| {
        let told = cells.iter().any(|cell| cell != "-");
        told.then_some((name.to_string(), cells))
    };
    let of = |cell: &dyn Fn(&Row) -> String| rows.iter().map(cell).collect::<Vec<String>>();
    let share = |v: f64| format!("{:.1}", 100.0 * v);
    let success = |row: &Row| {
        row.summary.as_ref().map_or("-".into(), |s| {
            let [low, high] = s.wilson_95;
            format!("{} % ({} to {})", share(s.success_rate), share(low), share(high))
        })
    };
    let episodes = |row: &Row| row.summary.as_ref().map_or("-".into(), |s| format!("{}/{}", s.successes, s.episodes));
    let mut columns = vec![
        Some(("run".to_string(), of(&|row| row.run.clone()))),
        Some(("success".to_string(), of(&success))),
        optional("episodes", of(&episodes)),
        Some(("task".to_string(), of(&|row| row.task.clone()))),
        optional("robot", of(&|row| row.robot.clone().unwrap_or("-".into()))),
        Some(("method".to_string(), of(&|row| row.method.clone()))),
        Some(("seed".to_string(), of(&|row| row.seed.to_string()))),
        optional("demos", of(&|row| row.demos.map_or("-".into(), |n| n.to_string()))),
        optional("wall time", of(&|row| row.wall_s.map_or("-".into(), |s| format!("{s:.0} s")))),
    ];
    columns.extend(differing.iter().map(|(key, values)| Some((key.clone(), values.iter().map(value_text).collect()))));
    let columns: Vec<(String, Vec<String>)> = columns.into_iter().flatten().collect();
    let header: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
    let cells: Vec<Vec<String>> =
        (0..rows.len()).map(|row| columns.iter().map(|(_, cells)| cells[row].clone()).collect()).collect();
    fitted_table(&header, &cells, width)
}

fn value_text(value: &Option<Value>) -> String {
    match value {
        None => "-".into(),
        Some(Value::String(text)) if text.is_empty() => DEFAULT.into(),
        Some(Value::String(text)) => text.clone(),
        Some(other) => other.to_string(),
    }
}

/// For machines: the rows, and of each the settings in which they differ.
pub fn to_json(rows: &[Row]) -> Value {
    let differing = differing(rows);
    let with_settings = |(at, row): (usize, &Row)| {
        let mut value = json!(row);
        let own = differing.iter().map(|(key, values)| (key.clone(), values[at].clone().unwrap_or(Value::Null)));
        value["differs"] = Value::Object(own.collect());
        value
    };
    json!({ "kind": "runs", "runs": rows.iter().enumerate().map(with_settings).collect::<Vec<_>>() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(run: &str, settings: &[(&str, Value)]) -> Row {
        let settings = settings.iter().map(|(key, value)| (key.to_string(), value.clone())).collect();
        Row {
            run: run.into(),
            task: "lift".into(),
            robot: None,
            method: "hil".into(),
            seed: 0,
            demos: Some(10),
            summary: None,
            wall_s: None,
            settings,
        }
    }

    #[test]
    fn only_settings_that_differ_are_told_and_a_key_that_one_lacks_is_no_difference() {
        let rows = [
            row("a", &[("train.rho", json!(0.3)), ("train.tau", json!(0.5)), ("train.ppo.worlds", json!(8))]),
            row("b", &[("train.rho", json!(0.6)), ("train.tau", json!(0.5))]),
        ];
        let keys: Vec<String> = differing(&rows).into_iter().map(|(key, _)| key).collect();
        assert_eq!(keys, ["train.rho"]);
        let text = to_text(&rows, None);
        assert!(text.starts_with("run  success  task  method  seed  demos  train.rho\n"), "{text}");
        assert_eq!(to_json(&rows)["runs"][1]["differs"], json!({ "train.rho": 0.6 }));
    }
}
