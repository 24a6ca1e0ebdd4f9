//! One run: its stages, and what its policies came to.

use super::artefacts::{Artefact, artefacts};
use super::standing::{Condition, Standing, file_name, stage_of};
use crate::config::Stage;
use crate::data::origin::{Kind, origin};
use crate::data::{Provenance, json_file, weights};
use crate::error::{Error, Result};
use crate::eval::Summary;
use crate::experiment::estimate::{processor_s_of, wall_s_of};
use crate::experiment::place::artefact_of;
use crate::interrupt::Interrupt;
use crate::learn::MethodName;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Directories above an experiment's run that may hold what it was made from: method, variation, preset, seed.
const ABOVE: usize = 4;

/// A run in a directory.
#[derive(Debug)]
pub struct Run {
    /// The directory.
    pub dir: PathBuf,
    /// What stands there of each stage, and what is missing.
    pub stages: Vec<Standing>,
    /// Its evaluations.
    pub judged: Vec<Judged>,
}

/// A policy that was evaluated.
#[derive(Clone, Debug)]
pub struct Judged {
    /// Method of the policy, "planner", or what else was evaluated.
    pub method: String,
    /// Summary of the evaluation.
    pub path: PathBuf,
    /// What it says.
    pub summary: Summary,
    /// Where it comes from.
    pub made: Provenance,
}

impl Run {
    /// Looks at all there is.
    ///
    /// # Errors
    /// [`Error::Io`] when the directory cannot be read; [`Error::Interrupted`].
    pub fn read(dir: &Path, interrupt: &Interrupt) -> Result<Self> {
        let mut stages: Vec<Standing> = Vec::new();
        for artefact in artefacts(dir)? {
            interrupt.check()?;
            stages.push(standing(&artefact));
        }
        for stage in [Stage::Train, Stage::Pretrain, Stage::Convert, Stage::Simulate, Stage::Plan] {
            interrupt.check()?;
            from_above(dir, stage, &mut stages);
        }
        stages.sort_by_key(|standing| standing.stage as usize);
        for at in 0..stages.len() {
            let (before, rest) = stages.split_at_mut(at);
            rest[0].judge(dir, &before.iter().collect::<Vec<_>>());
        }
        stages.iter_mut().for_each(|standing| times(dir, standing));
        let judged = stages.iter().filter_map(|standing| judge(standing, &stages)).collect();
        missing(dir, &mut stages);
        Ok(Run { dir: dir.to_path_buf(), stages, judged })
    }

    /// The task, as any of the artefacts says it.
    pub fn task(&self) -> Option<&str> {
        self.stages.iter().rev().find_map(|standing| Some(standing.origin.as_ref()?.0.task.as_str()))
    }

    /// For machines.
    pub fn to_json(&self) -> Value {
        let method = |judged: &Judged| json!({ "method": judged.method, "evaluation": judged.path.display().to_string(), "summary": judged.summary });
        let bytes: u64 = self.stages.iter().map(|standing| standing.bytes).sum();
        let walls: Vec<f64> = self.stages.iter().filter_map(|standing| standing.wall_s).collect();
        json!({
            "kind": "run",
            "directory": self.dir.display().to_string(),
            "task": self.task(),
            "evaluations": self.judged.iter().map(method).collect::<Vec<_>>(),
            "stages": self.stages.iter().map(Standing::to_json).collect::<Vec<_>>(),
            "bytes": bytes,
            "wall_s": (!walls.is_empty()).then(|| walls.iter().sum::<f64>()),
        })
    }
}

fn standing(artefact: &Artefact) -> Standing {
    let found = origin(&artefact.path, artefact.kind).map_err(|why| match why {
        Error::Input { path, message } if path == artefact.path => message,
        other => other.to_string(),
    });
    Standing::of(artefact, name_of(artefact), found)
}

/// As make calls the stage that leaves this file; otherwise by the file.
fn name_of(artefact: &Artefact) -> String {
    let (stage, file) = (artefact.stage, file_name(&artefact.path));
    let (usual, _) = artefact_of(stage);
    if file == usual {
        return stage.name().into();
    }
    let of_method = |method: MethodName| {
        let (stem, ending) = usual.split_once('.')?;
        (file == format!("{stem}-{}.{ending}", method.name())).then(|| format!("{}-{}", stage.name(), method.name()))
    };
    let by_method = matches!(stage, Stage::Train | Stage::Evaluate).then(|| MethodName::ALL.into_iter().find_map(of_method));
    by_method.flatten().unwrap_or_else(|| format!("{} ({file})", stage.name()))
}

/// An experiment keeps what runs share in the directories above them. What stands there belongs to the run if its own artefacts say that they were
/// made from it.
fn from_above(dir: &Path, stage: Stage, stages: &mut Vec<Standing>) {
    let wanted: Vec<String> = stages
        .iter()
        .filter_map(|standing| standing.origin.as_ref())
        .flat_map(|(made, _)| made.inputs.iter().filter(|(role, _)| stage_of(role) == Some(stage)).map(|(_, hash)| hash.clone()))
        .collect();
    if wanted.is_empty() || stages.iter().any(|standing| standing.stage == stage) {
        return;
    }
    let (name, kind) = artefact_of(stage);
    let method = dir.file_name().unwrap_or_default();
    let Ok(whole) = dir.canonicalize() else { return };
    for above in whole.ancestors().skip(1).take(ABOVE) {
        for path in [above.join(name), above.join(method).join(name)] {
            let kind = if stage == Stage::Train { Kind::Weights(weights::POLICY) } else { kind };
            if !path.exists() || path.parent() == Some(&whole) {
                continue;
            }
            let found = standing(&Artefact { stage, path, kind });
            if found.origin.as_ref().is_some_and(|(_, content)| wanted.contains(&content.to_string())) {
                stages.push(found);
                return;
            }
        }
    }
}

/// Times by the log of the stage: `logs/STAGE.log` in the run, of an experiment `logs/` and the way to the run in the directory of all.
fn times(dir: &Path, standing: &mut Standing) {
    let home = standing.path.parent().unwrap_or(dir);
    let own = [home.join("logs").join(format!("{}.log", standing.name))];
    let of_experiment = home.ancestors().skip(1).take(ABOVE + 1).filter_map(|root| {
        let way = home.strip_prefix(root).ok()?;
        Some(root.join("logs").join(way).join(format!("{}.log", standing.stage.name())))
    });
    let Some(log) = own.into_iter().chain(of_experiment).find(|log| log.is_file()) else { return };
    (standing.wall_s, standing.processor_s) = (wall_s_of(&log), processor_s_of(&log));
}

/// The answer of an evaluation; `None` where it cannot be read.
fn judge(standing: &Standing, stages: &[Standing]) -> Option<Judged> {
    let (made, _) = standing.origin.as_ref().filter(|_| standing.stage == Stage::Evaluate)?;
    let (content, _) = json_file::read(&standing.path).ok()?;
    let policies = || stages.iter().filter(|other| other.stage == Stage::Train).filter_map(|other| other.origin.as_ref());
    let policy = policies().find(|(_, content)| made.inputs.get("policy") == Some(&content.to_string()));
    let method = policy.map(|(made, _)| made).and_then(|made| made.settings["method"].as_str()).map(String::from);
    let method = method.unwrap_or_else(|| method_of(&standing.path, made));
    Some(Judged { method, path: standing.path.clone(), summary: serde_json::from_value(content).ok()?, made: made.clone() })
}

/// Who was evaluated, where the policy itself is not there to say: by the evaluation, then by names.
pub(super) fn method_of(path: &Path, made: &Provenance) -> String {
    match &made.settings["policy"] {
        Value::String(said) if said != weights::POLICY => return said.clone(),
        Value::Object(served) => return served.get("address").and_then(Value::as_str).unwrap_or("served").into(),
        _ => {}
    }
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let place = path.parent().and_then(Path::file_name).unwrap_or_default().to_string_lossy().into_owned();
    let known = |method: &MethodName| stem.ends_with(&format!("-{}", method.name())) || place == method.name();
    MethodName::ALL.into_iter().rev().find(known).map_or("policy", MethodName::name).into()
}

/// Adds the stages that a policy or a demonstration still needs, and says what of them was begun.
fn missing(dir: &Path, stages: &mut Vec<Standing>) {
    let has = |stages: &[Standing], stage: Stage| stages.iter().any(|standing| standing.stage == stage);
    let policies = || stages.iter().filter(|s| s.stage == Stage::Train).filter_map(|s| s.origin.as_ref());
    // Reinforcement learning needs no demos; those of another program have a dataset elsewhere.
    let elsewhere =
        |made: &Provenance| made.settings["method"] == MethodName::Ppo.name() || made.settings.get("columns").is_some();
    let needs_none = policies().count() > 0 && policies().all(|(made, _)| elsewhere(made));
    for stage in Stage::ALL {
        let early = (stage as usize) < Stage::Train as usize;
        // A demonstrator and a policy of elsewhere are evaluated without the rest.
        let only_judged = stages.iter().all(|standing| standing.stage == Stage::Evaluate);
        if has(stages, stage) || (needs_none && early) || only_judged {
            continue;
        }
        let (name, _) = artefact_of(stage);
        let path = dir.join(name);
        let begun = match stage {
            Stage::Plan | Stage::Simulate => path.with_extension("unfinished").is_dir().then_some("its command goes on"),
            Stage::Train => path
                .with_extension("checkpoint.safetensors")
                .is_file()
                .then_some("hilt train --resume, or make all RESUME=1, goes on"),
            _ => None,
        };
        let condition = if begun.is_some() { Condition::Unfinished } else { Condition::Missing };
        let (why, name) = (begun.map(String::from), stage.name().to_string());
        let none = Standing { stage, name, path, condition, why, bytes: 0, wall_s: None, processor_s: None, origin: None };
        stages.push(none);
    }
    stages.sort_by_key(|standing| standing.stage as usize);
}
