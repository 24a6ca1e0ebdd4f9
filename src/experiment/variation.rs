//! A variation as a file has it, checked.

use super::spec::{Experiment, MethodSets, Variation};
use super::wording::{check_name, method_sets, not_empty, parsed, task_names};
use crate::config::Stage;
use crate::learn::MethodName;
use crate::words::unknown;
use serde::Deserialize;
use std::collections::BTreeMap;

/// Keys of a variation.
pub(super) const KEYS: [&str; 7] = ["name", "extends", "set", "method_set", "stages", "tasks", "methods"];
/// Files and directories, their endings aside, that stand where the name of a variation would.
const TAKEN: [&str; 6] = ["plans", "recordings", "dataset", "dynamics", "logs", "rollouts"];

/// As a file has it.
#[derive(Deserialize)]
pub(super) struct Raw {
    pub(super) name: String,
    /// An earlier variation, whose settings come first.
    extends: Option<String>,
    #[serde(default)]
    set: Vec<String>,
    #[serde(default)]
    method_set: BTreeMap<String, Vec<String>>,
    stages: Option<Vec<String>>,
    tasks: Option<Vec<String>>,
    methods: Option<Vec<String>>,
}

impl Raw {
    /// With names in place of words.
    ///
    /// # Errors
    /// What is wrong, in words.
    pub(super) fn check(&self, of: &Experiment) -> std::result::Result<Variation, String> {
        check_name("the name", &self.name)?;
        let method = MethodName::ALL.map(MethodName::name).contains(&self.name.as_str());
        let stem = self.name.split('.').next().unwrap_or_default();
        if method || TAKEN.contains(&stem) {
            return Err("this name is taken by another directory of a run; choose another".into());
        }
        let stages = self.stages.as_ref().map_or(Ok(Stage::ALL.to_vec()), |words| parsed(words))?;
        let tasks = self.tasks.as_ref().map_or(Ok(of.tasks.clone()), |words| task_names(words))?;
        let methods = self.methods.as_ref().map_or(Ok(of.methods.clone()), |words| parsed(words))?;
        for list in [("stages", stages.len()), ("tasks", tasks.len()), ("methods", methods.len())] {
            not_empty(list)?;
        }
        let foreign = tasks.iter().filter(|t| !of.tasks.contains(t)).map(|t| format!("task {t}"));
        let foreign = foreign.chain(methods.iter().filter(|m| !of.methods.contains(m)).map(|m| format!("method {}", m.name())));
        if let Some(foreign) = foreign.into_iter().next() {
            return Err(format!("{foreign} is none of the experiment's; add it there too"));
        }
        let (mut set, mut method_set) = match &self.extends {
            Some(name) => earlier(name, of)?,
            None => Default::default(),
        };
        set.extend(self.set.iter().cloned());
        for (method, own) in method_sets(&self.method_set, &methods)? {
            method_set.entry(method).or_default().extend(own);
        }
        method_set.retain(|method, _| methods.contains(method));
        Ok(Variation { name: self.name.clone(), extends: self.extends.clone(), set, method_set, stages, tasks, methods })
    }
}

/// The settings of a variation that stands before.
fn earlier(name: &str, of: &Experiment) -> std::result::Result<(Vec<String>, MethodSets), String> {
    let found = of.variations.iter().find(|v| v.name == name).map(|v| (v.set.clone(), v.method_set.clone()));
    let known: Vec<&str> = of.variations.iter().map(|v| v.name.as_str()).collect();
    found.ok_or_else(|| format!("extends: {} (only those before it)", unknown("variation", name, &known)))
}
