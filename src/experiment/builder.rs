//! From settings to steps: each is made once, and lies with the first run that needs it.

use super::estimate;
use super::place::{artefact_of, outputs_of};
use super::resolve::{Cell, StageSettings};
use super::runs::Run;
use super::spec::{Experiment, Variation};
use super::step::{Input, Step};
use crate::config::Stage;
use crate::data::Provenance;
use crate::data::origin::Kind;
use crate::error::{Error, Result};
use crate::learn::MethodName;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// A cell of the grid and a seed.
pub(super) struct At<'a> {
    pub(super) task: &'a str,
    pub(super) preset: &'a str,
    pub(super) variation: Option<&'a Variation>,
    pub(super) seed: u64,
}

impl At<'_> {
    /// Below the experiment's directory.
    fn dir(&self, varied: bool, method: Option<MethodName>) -> PathBuf {
        let mut dir = PathBuf::from(self.task).join(format!("seed-{}", self.seed)).join(self.preset);
        if let Some(variation) = self.variation.filter(|_| varied) {
            dir.push(&variation.name);
        }
        method.iter().for_each(|method| dir.push(method.name()));
        dir
    }
}

/// Makes the steps of one run after another.
pub(super) struct Builder<'a> {
    experiment: &'a Experiment,
    dir: &'a Path,
    pub(super) steps: Vec<Step>,
    /// Steps by everything that decides what they write.
    known: HashMap<String, usize>,
}

impl<'a> Builder<'a> {
    /// No steps yet; their files go below `dir`.
    pub(super) fn new(experiment: &'a Experiment, dir: &'a Path) -> Self {
        Builder { experiment, dir, steps: Vec::new(), known: HashMap::new() }
    }

    /// The steps of one run; those that an earlier run has are the same steps.
    pub(super) fn run(&mut self, at: &At, method: MethodName, settings: &Cell, base: &Cell) -> Result<Run> {
        let mut varied = false;
        let mut shared = |stage: Stage| {
            varied |= settings[stage as usize].json != base[stage as usize].json;
            at.dir(varied, None)
        };
        let dataset = match &self.experiment.dataset {
            _ if !method.needs_demos() => None,
            Some(given) => Some(self.given(given, at)),
            None => {
                let (plan, simulate, convert) = (shared(Stage::Plan), shared(Stage::Simulate), shared(Stage::Convert));
                let plans = self.step(at, Stage::Plan, None, &plan, vec![], settings)?;
                let plans = self.input("plans", plans);
                let recordings = self.step(at, Stage::Simulate, None, &simulate, vec![plans], settings)?;
                let recordings = self.input("recordings", recordings);
                let dataset = self.step(at, Stage::Convert, None, &convert, vec![recordings], settings)?;
                Some(self.input("dataset", dataset))
            }
        };
        let mut learns_from = Vec::from_iter(dataset);
        if method.needs_dynamics() {
            let dynamics = self.step(at, Stage::Pretrain, None, &shared(Stage::Pretrain), learns_from.clone(), settings)?;
            learns_from.push(self.input("dynamics", dynamics));
        }
        let own = at.dir(true, Some(method));
        let train = self.step(at, Stage::Train, Some(method), &own, learns_from, settings)?;
        let policy = self.input("policy", train);
        let evaluate = self.step(at, Stage::Evaluate, Some(method), &own, vec![policy], settings)?;
        let variation = at.variation.map_or(String::new(), |v| v.name.clone());
        Ok(Run { task: at.task.into(), preset: at.preset.into(), variation, method, seed: at.seed, train, evaluate })
    }

    fn input(&self, role: &'static str, from: usize) -> Input {
        let output = &self.steps[from].outputs[0];
        Input { role, path: output.path.clone(), kind: output.kind, from: Some(from) }
    }

    /// A dataset that was there before.
    fn given(&self, path: &str, at: &At) -> Input {
        let path = path.replace("{task}", at.task).replace("{seed}", &at.seed.to_string());
        Input { role: "dataset", path: path.into(), kind: Kind::Datasets, from: None }
    }

    /// The step that does this, a new one if there is none yet.
    fn step(
        &mut self,
        at: &At,
        stage: Stage,
        method: Option<MethodName>,
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
            task: at.task.into(),
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
fn provenance(stage: Stage, at: &At, method: Option<MethodName>, settings: &serde_json::Value) -> Provenance {
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
