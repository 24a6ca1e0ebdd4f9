//! The settings of every stage for one task, preset, variation and method.

use super::spec::{Experiment, MethodSets, Variation};
use crate::config::{ChosenTask, Pipeline, Preset, Source, Stage, is_file};
use crate::error::{Error, Result};
use crate::learn::MethodName;
use crate::plan::check_ready_pose;
use crate::words::{shown, unknown};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Where presets that do not come with hilt are, a directory each.
const PIPELINES: &str = "pipelines";
// Keys of parts that a method may lack. A dot or underscore ends a family.
const OF_STATE_CLONING: &[&str] =
    &["pretrain.", "train.alpha", "train.rho", "train.sc.", "train.fine_tune_dynamics", "train.dynamics_"];
const OF_REWARDS: &[&str] = &["train.ppo.", "train.bc_rl."];
const OF_DEMOS: &[&str] = &[
    "plan.",
    "convert.",
    "train.randomise.",
    "train.loss",
    "train.action",
    "train.initial_std",
    "train.d_conv",
    "train.tau",
    "train.warm_start_",
    "train.bc_batch",
    "train.epochs",
    "train.min_updates",
    "train.batch",
    "train.learning_rate",
    "train.clip_norm",
    "train.ema_decay",
];
/// Keys of `[train.ppo]` that `[train.bc_rl]` or the demos stand for in behavior cloning that goes on with rewards.
const OF_PPO_ALONE: &[&str] = &[
    "train.ppo.action_unit",
    "train.ppo.reward",
    "train.ppo.initial_std",
    "train.ppo.horizon_steps",
    "train.ppo.learning_rate",
    "train.ppo.final_learning_rate",
];

/// Keys without effect on a method.
fn not_of(method: MethodName) -> Vec<&'static str> {
    let parts: &[&[&str]] = match method {
        MethodName::Hil => &[&["train.sc.features"], OF_REWARDS],
        MethodName::Bc => &[OF_STATE_CLONING, OF_REWARDS],
        MethodName::Sc => &[&["train.features", "train.alpha", "train.bc_batch"], OF_REWARDS],
        MethodName::Ppo => &[OF_DEMOS, OF_STATE_CLONING, &["train.bc_rl."]],
        MethodName::BcRl => &[OF_STATE_CLONING, OF_PPO_ALONE],
    };
    parts.concat()
}

/// What one stage does in a cell of the grid.
#[derive(Clone, Debug)]
pub struct StageSettings {
    /// The flags that name the settings.
    pub words: Vec<String>,
    /// What the stage reads of them, as its provenance has it.
    pub json: Value,
    /// All of them.
    pub pipeline: Pipeline,
}

/// The settings of all stages, by their order.
pub type Cell = [StageSettings; 6];

/// The settings of `task` under a preset, with a variation's over them, for each of the experiment's methods; where both have settings of the
/// method alone, these go over their others.
///
/// # Errors
/// [`Error::Usage`] names what is wrong and where.
pub fn cells(experiment: &Experiment, task: &str, preset: &str, variation: Option<&Variation>) -> Result<Vec<Cell>> {
    let shared = cell(experiment, task, preset, variation, None)?;
    let has_own = |method: &MethodName| {
        experiment.method_set.contains_key(method) || variation.is_some_and(|v| v.method_set.contains_key(method))
    };
    let of = |method: &MethodName| {
        if has_own(method) { cell(experiment, task, preset, variation, Some(*method)) } else { Ok(shared.clone()) }
    };
    experiment.methods.iter().map(of).collect()
}

/// The same for one method, or for those without settings of their own.
fn cell(
    experiment: &Experiment,
    task: &str,
    preset: &str,
    variation: Option<&Variation>,
    method: Option<MethodName>,
) -> Result<Cell> {
    let at = match variation {
        Some(variation) => format!("{}: variation \"{}\"", experiment.path.display(), variation.name),
        None => experiment.path.display().to_string(),
    };
    let says = |why: Error| match why {
        Error::Usage(why) => Error::Usage(format!("{at}: {why}")),
        other => other,
    };
    let checked = check_method_set(&experiment.method_set).and_then(|()| variation.map_or(Ok(()), check_variation));
    checked.map_err(|why| Error::Usage(format!("{at}: {why}")))?;
    let said = experiment.tasks.iter().zip(&experiment.said).find(|(name, _)| *name == task).map_or(task, |(_, said)| said);
    let (source, words) = source_of((task, said), preset).map_err(|why| Error::Usage(format!("{at}: {why}")))?;
    let own_of = |sets: &MethodSets| method.and_then(|method| sets.get(&method)).cloned().unwrap_or_default();
    let stages = Stage::ALL.map(|stage| {
        let varied = variation.filter(|v| v.stages.contains(&stage));
        let varied = varied.map(|v| [v.set.clone(), own_of(&v.method_set)].concat()).unwrap_or_default();
        let episodes = experiment.episodes.map(|n| format!("evaluate.episodes={n}"));
        let sets = [experiment.set.clone(), Vec::from_iter(episodes), own_of(&experiment.method_set), varied].concat();
        stage_settings(stage, &source, &words, &sets)
    });
    let mut resolved = Vec::with_capacity(Stage::ALL.len());
    for stage in stages {
        resolved.push(stage.map_err(says)?);
    }
    Ok(resolved.try_into().expect("a stage each"))
}

/// The settings of a stage with `sets` over those of the source.
fn stage_settings(stage: Stage, source: &Source, words: &[String], sets: &[String]) -> Result<StageSettings> {
    let pipeline = Pipeline::load(source, sets)?;
    check_ready_pose(&pipeline.robot, &pipeline.scene)?;
    // What another stage reads changes nothing here.
    let read = sets.iter().filter(|set| stage.sections().contains(&section_of(set)));
    let words = words.iter().cloned().chain(read.flat_map(|set| ["--set".to_string(), set.clone()])).collect();
    Ok(StageSettings { words, json: pipeline.to_json(stage)?, pipeline })
}

/// `train.rho=0.3` is of `train`.
fn section_of(set: &str) -> &str {
    set.split(['.', '=']).next().unwrap_or_default().trim()
}

/// `said` is how the experiment has the task: by its name or its file.
fn source_of((task, said): (&str, &str), preset: &str) -> std::result::Result<(Source, Vec<String>), String> {
    if let Ok(known) = preset.parse::<Preset>() {
        let words = ["--task".to_string(), said.into(), "--preset".into(), preset.into()];
        let words = if known == Preset::default() { words[..2].to_vec() } else { words.to_vec() };
        // A task's file is a pipeline file: its own settings, unless another preset is asked for.
        if is_file(said) && known == Preset::default() {
            return Ok((Source::File(said.into(), None), words));
        }
        return Ok((Source::BuiltIn(ChosenTask::read(said)?, known), words));
    }
    let path = Path::new(PIPELINES).join(preset).join(format!("{task}.toml"));
    if path.is_file() {
        let words = vec!["--pipeline".into(), path.display().to_string(), "--task".into(), said.into()];
        return Ok((Source::File(path, Some(ChosenTask::read(said)?)), words));
    }
    let has_file = |dir: &Path| dir.join(format!("{task}.toml")).is_file();
    let entries = fs::read_dir(PIPELINES).into_iter().flatten().flatten();
    let own = entries.filter(|e| has_file(&e.path())).filter_map(|e| e.file_name().to_str().map(String::from));
    let known: BTreeSet<String> = own.chain(Preset::ALL.map(|p| p.name().into())).collect();
    let known: Vec<&str> = known.iter().map(String::as_str).collect();
    Err(format!("{} (there is no {})", unknown("preset", preset, &known), path.display()))
}

/// Every setting of a variation must be read by one of its stages, and do something for each of its methods.
fn check_variation(variation: &Variation) -> std::result::Result<(), String> {
    let stages: Vec<&str> = variation.stages.iter().map(|s| s.name()).collect();
    for set in &variation.set {
        let section = section_of(set);
        let is_section = Stage::ALL.iter().any(|stage| stage.sections().contains(&section));
        if is_section && !variation.stages.iter().any(|stage| stage.sections().contains(&section)) {
            return Err(format!("set \"{}\" is read by none of its stages ({})", shown(set), stages.join(", ")));
        }
    }
    if !variation.method_set.is_empty() && !variation.stages.contains(&Stage::Train) {
        return Err(format!("method_set is read by none of its stages ({})", stages.join(", ")));
    }
    check_method_set(&variation.method_set)?;
    let unchanged = |method: &&MethodName| {
        !variation.set.is_empty() && !variation.method_set.contains_key(method) && changes_nothing(&variation.set, **method)
    };
    match variation.methods.iter().find(unchanged) {
        Some(method) => {
            let (method, set) = (method.name(), shown(&variation.set.join(" ")));
            Err(format!("\"{set}\" changes nothing of method {method}: limit the variation by methods = [...]"))
        }
        None => Ok(()),
    }
}

/// Every setting of a method alone must do something for it.
fn check_method_set(sets: &MethodSets) -> std::result::Result<(), String> {
    for (method, set) in sets {
        if let Some(set) = set.iter().find(|set| changes_nothing(std::slice::from_ref(*set), *method)) {
            return Err(format!("method_set: \"{}\" changes nothing of method {}", shown(set), method.name()));
        }
    }
    Ok(())
}

/// Whether a method reads none of these settings.
fn changes_nothing(sets: &[String], method: MethodName) -> bool {
    let families = not_of(method);
    sets.iter().all(|set| families.iter().any(|family| set.trim_start().starts_with(family)))
}
