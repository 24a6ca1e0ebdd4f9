//! An evaluation with its episodes, from whatever was named: a run, its summary or the table of its episodes.

use crate::config::Stage;
use crate::data::peek::{Format, peek};
use crate::data::{Provenance, table_file};
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use crate::report::runs::{Judged, Run, is_run, list};
use crate::table::{Table, Values};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// The ending of the table of episodes, in place of that of the summary.
const EPISODES: &str = "episodes.parquet";

/// An evaluation.
#[derive(Clone, Debug)]
pub struct Evaluated {
    /// What it is called in words.
    pub name: String,
    /// Method of the policy, where the run says it.
    pub method: Option<String>,
    /// The table of its episodes.
    pub path: PathBuf,
    /// Where it comes from.
    pub made: Provenance,
    /// Settings that the policy was trained with, where its weights stand there.
    pub trained: Option<Value>,
    /// A row an episode.
    pub episodes: Table,
}

/// Evaluations at `path`: the one of a file; those of a run, one a method; those of all runs below a directory.
///
/// # Errors
/// [`Error::Input`] when there is none; what reading returns.
pub fn find(path: &Path, interrupt: &Interrupt) -> Result<Vec<Evaluated>> {
    if !path.is_dir() {
        let table = if peek(path).map_err(|e| Error::io(path, "read", e))?.format == Format::Json {
            path.with_extension(EPISODES)
        } else {
            path.to_path_buf()
        };
        return Ok(vec![Evaluated::read(path.display().to_string(), None, &table, None)?]);
    }
    if is_run(path) {
        let found = of_run(path, interrupt)?;
        if !found.is_empty() {
            return Ok(found);
        }
    }
    let mut found = Vec::new();
    let mut places: Vec<PathBuf> = Vec::new();
    for row in list(path, interrupt)?.iter().filter(|row| row.summary.is_some()) {
        let place = path.join(&row.run);
        let place = if place.is_dir() { place } else { place.parent().unwrap_or(path).to_path_buf() };
        if !places.contains(&place) {
            places.push(place);
        }
    }
    places.sort();
    for place in places {
        found.extend(of_run(&place, interrupt)?);
    }
    if found.is_empty() {
        return Err(Error::input(path, "holds no evaluation; hilt evaluate --out evaluation.json makes one"));
    }
    Ok(found)
}

fn of_run(dir: &Path, interrupt: &Interrupt) -> Result<Vec<Evaluated>> {
    let run = Run::read(dir, interrupt)?;
    let trained = |judged: &Judged| {
        let policies = run.stages.iter().filter(|standing| standing.stage == Stage::Train).filter_map(|s| s.origin.as_ref());
        let own = policies.map(|(made, content)| (made, content.to_string()));
        own.into_iter()
            .find(|(_, content)| judged.made.inputs.get("policy") == Some(content))
            .map(|(made, _)| made.settings.clone())
    };
    let read = |judged: &Judged| {
        let name = format!("{} ({})", judged.path.display(), judged.method);
        Evaluated::read(name, Some(judged.method.clone()), &judged.path.with_extension(EPISODES), trained(judged))
    };
    run.judged.iter().map(read).collect()
}

impl Evaluated {
    fn read(name: String, method: Option<String>, path: &Path, trained: Option<Value>) -> Result<Self> {
        if !path.is_file() {
            let message = "is missing: the table of episodes stands beside the summary; run hilt evaluate --out again";
            return Err(Error::input(path, message));
        }
        let (episodes, made) = table_file::read(path)?;
        let evaluated = Evaluated { name, method, path: path.to_path_buf(), made, trained, episodes };
        if evaluated.made.stage != Stage::Evaluate.name() || evaluated.columns().is_none() {
            let stage = &evaluated.made.stage;
            let message = format!(
                "is a table of hilt {stage}, not the episodes of an evaluation; expected evaluation.json or evaluation.{EPISODES}"
            );
            return Err(Error::input(path, message));
        }
        Ok(evaluated)
    }

    /// Numbers of the episodes, whether each was solved, why not, and its steps; `None` for another table.
    fn columns(&self) -> Option<Columns<'_>> {
        let values = |name| self.episodes.column(name).map(|column| &column.values);
        match ["episode", "success", "failure", "steps"].map(values) {
            [Some(Values::I64(episode)), Some(Values::Bool(success)), Some(Values::Text(failure)), Some(Values::I64(steps))] => {
                Some(Columns { episode, success, failure, steps })
            }
            _ => None,
        }
    }

    /// How its episodes ended, in the order of the table.
    pub(super) fn outcomes(&self) -> Vec<Outcome<'_>> {
        let Some(Columns { episode, success, failure, steps }) = self.columns() else { return Vec::new() };
        let outcome =
            |row: usize| Outcome { row, episode: episode[row], success: success[row], failure: &failure[row], steps: steps[row] };
        (0..episode.len()).map(outcome).collect()
    }

    /// (solved, all).
    pub fn counts(&self) -> (u64, u64) {
        let outcomes = self.outcomes();
        (outcomes.iter().filter(|outcome| outcome.success).count() as u64, outcomes.len() as u64)
    }
}

struct Columns<'a> {
    episode: &'a [i64],
    success: &'a [bool],
    failure: &'a [String],
    steps: &'a [i64],
}

/// How an episode ended.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outcome<'a> {
    pub(super) row: usize,
    pub(super) episode: i64,
    pub(super) success: bool,
    pub(super) failure: &'a str,
    pub(super) steps: i64,
}

impl Outcome<'_> {
    /// "success", or the class of the failure.
    pub(super) fn name(&self) -> &str {
        if self.success { "success" } else { self.failure }
    }
}
