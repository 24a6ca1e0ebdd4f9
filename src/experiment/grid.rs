//! From an experiment to its runs and the steps that they share.

use super::estimate;
use super::file::{Experiment, Variation};
use super::place::{artefact_of, outputs_of};
use super::resolve::{Cell, StageSettings, cell};
use super::step::{Input, Step};
use crate::config::Stage;
use crate::data::Provenance;
use crate::data::origin::Kind;
use crate::error::{Error, Result};
use crate::learn::Method;
use crate::tasks::Task;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// More runs than one machine does in a year.
const MOST_RUNS: usize = 100_000;

/// One policy and its evaluation: a row of the results.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// The task.
    pub task: Task,
    /// The preset.
    pub preset: String,
    /// The variation; empty = the plain settings.
    pub variation: String,
    /// The method.
    pub method: Method,
    /// The seed.
    pub seed: u64,
    /// The step that trains, by its place among the steps.
    pub train: usize,
    /// The step that evaluates.
    pub evaluate: usize,
}

/// All of an experiment.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Its commands, each after those that it needs; seed by seed, so that a first comparison is there early.
    pub steps: Vec<Step>,
    /// Its runs, in the order of the file: task, preset, variation, method, seed.
    pub runs: Vec<Run>,
}

impl Grid {
    /// The runs of an experiment whose files go below `dir`.
    ///
    /// # Errors
    /// [`Error::Usage`] for settings that do not exist, a grid that is too large, and variations or presets that come to the same run.
    pub fn expand(experiment: &Experiment, dir: &Path) -> Result<Self> {
        let variations = choices(experiment);
        let of_a_seed = experiment.tasks.len() * experiment.presets.len() * variations.len() * experiment.methods.len();
        if of_a_seed.saturating_mul(experiment.seeds.len()) > MOST_RUNS {
            let (file, seeds) = (experiment.path.display(), experiment.seeds.len());
            return Err(Error::Usage(format!("{file}: {of_a_seed} x {seeds} runs; allowed: up to {MOST_RUNS}")));
        }
        let mut cells = Vec::new();
        for (t, task) in experiment.tasks.iter().enumerate() {
            for (p, preset) in experiment.presets.iter().enumerate() {
                let base = cell(experiment, *task, preset, None)?;
                for (v, variation) in variations.iter().enumerate() {
                    if variation.is_none_or(|v| v.tasks.contains(task)) {
                        let settings = cell(experiment, *task, preset, *variation)?;
                        cells.push(([t, p, v], settings, base.clone()));
                    }
                }
            }
        }
        let mut builder = Builder { experiment, dir, steps: Vec::new(), known: HashMap::new() };
        let mut runs = Vec::new();
        for (s, seed) in experiment.seeds.iter().enumerate() {
            for ([t, p, v], settings, base) in &cells {
                for (m, method) in experiment.methods.iter().enumerate() {
                    if variations[*v].is_none_or(|v| v.methods.contains(method)) {
                        let at = At {
                            task: experiment.tasks[*t],
                            preset: &experiment.presets[*p],
                            variation: variations[*v],
                            seed: *seed,
                        };
                        runs.push(([*t, *p, *v, m, s], builder.run(&at, *method, settings, base)?));
                    }
                }
            }
        }
        runs.sort_by_key(|(order, _)| *order);
        let runs: Vec<Run> = runs.into_iter().map(|(_, run)| run).collect();
        if runs.is_empty() {
            let file = experiment.path.display();
            return Err(Error::Usage(format!("{file}: no variation has any of its tasks and methods: there is nothing to run")));
        }
        check_apart(experiment, &runs)?;
        Ok(Grid { steps: builder.steps, runs })
    }

    /// For each step the steps that need it.
    pub fn needed_by(&self) -> Vec<Vec<usize>> {
        let mut needed = vec![Vec::new(); self.steps.len()];
        for (i, step) in self.steps.iter().enumerate() {
            step.needs().for_each(|from| needed[from].push(i));
        }
        needed
    }
}

/// The variations; one without a name where there are none.
fn choices(experiment: &Experiment) -> Vec<Option<&Variation>> {
    if experiment.variations.is_empty() { vec![None] } else { experiment.variations.iter().map(Some).collect() }
}

/// No two runs may be the same one.
fn check_apart(experiment: &Experiment, runs: &[Run]) -> Result<()> {
    let mut first: HashMap<usize, &Run> = HashMap::new();
    for run in runs {
        if let Some(other) = first.insert(run.evaluate, run) {
            let (file, task, method) = (experiment.path.display(), run.task, run.method.name());
            let (a, b) = if other.variation == run.variation {
                (format!("presets \"{}\"", other.preset), format!("\"{}\"", run.preset))
            } else {
                (format!("variations \"{}\"", other.variation), format!("\"{}\"", run.variation))
            };
            return Err(Error::Usage(format!("{file}: {a} and {b} come to the same settings of {task}, {method}: remove one")));
        }
    }
    Ok(())
}

/// A cell of the grid and a seed.
struct At<'a> {
    task: Task,
    preset: &'a str,
    variation: Option<&'a Variation>,
    seed: u64,
}

impl At<'_> {
    /// Below the experiment's directory.
    fn dir(&self, varied: bool, method: Option<Method>) -> PathBuf {
        let mut dir = PathBuf::from(self.task.name()).join(format!("seed-{}", self.seed)).join(self.preset);
        if let Some(variation) = self.variation.filter(|_| varied) {
            dir.push(&variation.name);
        }
        method.iter().for_each(|method| dir.push(method.name()));
        dir
    }
}

struct Builder<'a> {
    experiment: &'a Experiment,
    dir: &'a Path,
    steps: Vec<Step>,
    /// Steps by everything that decides what they write.
    known: HashMap<String, usize>,
}

impl Builder<'_> {
    /// The steps of one run; those that an earlier run has are the same steps.
    fn run(&mut self, at: &At, method: Method, settings: &Cell, base: &Cell) -> Result<Run> {
        let mut varied = false;
        let mut shared = |stage: Stage| {
            varied |= settings[stage as usize].json != base[stage as usize].json;
            at.dir(varied, None)
        };
        let dataset = match &self.experiment.dataset {
            Some(given) => self.given(given, at),
            None => {
                let (plan, simulate, convert) = (shared(Stage::Plan), shared(Stage::Simulate), shared(Stage::Convert));
                let plans = self.step(at, Stage::Plan, None, &plan, vec![], settings)?;
                let plans = self.input("plans", plans);
                let recordings = self.step(at, Stage::Simulate, None, &simulate, vec![plans], settings)?;
                let recordings = self.input("recordings", recordings);
                let dataset = self.step(at, Stage::Convert, None, &convert, vec![recordings], settings)?;
                self.input("dataset", dataset)
            }
        };
        let mut learns_from = vec![dataset.clone()];
        // Behavior cloning needs no dynamics network.
        if method != Method::Bc {
            let dynamics = self.step(at, Stage::Pretrain, None, &shared(Stage::Pretrain), vec![dataset], settings)?;
            learns_from.push(self.input("dynamics", dynamics));
        }
        let own = at.dir(true, Some(method));
        let train = self.step(at, Stage::Train, Some(method), &own, learns_from, settings)?;
        let policy = self.input("policy", train);
        let evaluate = self.step(at, Stage::Evaluate, Some(method), &own, vec![policy], settings)?;
        let variation = at.variation.map_or(String::new(), |v| v.name.clone());
        Ok(Run { task: at.task, preset: at.preset.into(), variation, method, seed: at.seed, train, evaluate })
    }

    fn input(&self, role: &'static str, from: usize) -> Input {
        let output = &self.steps[from].outputs[0];
        Input { role, path: output.path.clone(), kind: output.kind, from: Some(from) }
    }

    /// A dataset that was there before.
    fn given(&self, path: &str, at: &At) -> Input {
        let path = path.replace("{task}", at.task.name()).replace("{seed}", &at.seed.to_string());
        Input { role: "dataset", path: path.into(), kind: Kind::Datasets, from: None }
    }

    /// The step that does this, a new one if there is none yet.
    fn step(
        &mut self,
        at: &At,
        stage: Stage,
        method: Option<Method>,
        dir: &Path,
        inputs: Vec<Input>,
        settings: &Cell,
    ) -> Result<usize> {
        let StageSettings { words, json, pipeline } = &settings[stage as usize];
        let reads: Vec<&PathBuf> = inputs.iter().map(|input| &input.path).collect();
        let key = format!("{} {} {} {method:?} {reads:?} {json}", stage.name(), at.task, at.seed);
        if let Some(known) = self.known.get(&key) {
            return Ok(*known);
        }
        let place = self.dir.join(dir);
        let outputs = outputs_of(stage, &place, self.experiment.record);
        let mut line = vec![stage.name().to_string()];
        line.extend(words.iter().cloned());
        line.extend(["--seed".into(), at.seed.to_string()]);
        if let (Stage::Train, Some(method)) = (stage, method) {
            line.extend(["--method", method.name(), "--resume"].map(String::from));
        }
        for input in &inputs {
            line.extend([format!("--{}", input.role), text(&input.path)?]);
        }
        line.extend(["--out".into(), text(&place.join(artefact_of(stage).0))?]);
        if let Some(rollouts) = outputs.iter().find(|o| stage == Stage::Evaluate && o.kind == Kind::Recordings) {
            line.extend(["--record".into(), text(&rollouts.path)?]);
        }
        let id = text(&dir.join(stage.name()))?;
        self.known.insert(key, self.steps.len());
        self.steps.push(Step {
            log: self.dir.join("logs").join(format!("{id}.log")),
            id,
            stage,
            task: at.task,
            seed: at.seed,
            method,
            words: line,
            inputs,
            outputs,
            provenance: provenance(stage, at, method, json),
            cost_s: estimate::cost_s(stage, pipeline, method),
        });
        Ok(self.steps.len() - 1)
    }
}

/// What the stage will write of its origin, without its inputs.
fn provenance(stage: Stage, at: &At, method: Option<Method>, settings: &serde_json::Value) -> Provenance {
    let mut provenance = Provenance::new(stage.name(), at.task, settings.clone(), at.seed);
    match (stage, method) {
        (Stage::Train, Some(method)) => provenance.settings["method"] = method.name().into(),
        (Stage::Evaluate, _) => provenance.settings["policy"] = "policy".into(),
        _ => {}
    }
    provenance
}

fn text(path: &Path) -> Result<String> {
    let unfit = || Error::Usage(format!("{}: the name is not UTF-8, which a command line needs here", path.display()));
    path.to_str().map(String::from).ok_or_else(unfit)
}
