//! One command of an experiment.

use crate::config::Stage;
use crate::data::Provenance;
use crate::data::origin::Kind;
use crate::learn::MethodName;
use std::path::{Path, PathBuf};

/// A command line of hilt, what it reads and what it leaves.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// Its name: the directory below the experiment's, and the stage.
    pub id: String,
    /// The stage.
    pub stage: Stage,
    /// The task's name.
    pub task: String,
    /// The seed.
    pub seed: u64,
    /// The method, of a training and its evaluation.
    pub method: Option<MethodName>,
    /// The arguments: stage, settings, inputs and outputs; neither threads nor log.
    pub words: Vec<String>,
    /// What it reads.
    pub inputs: Vec<Input>,
    /// What it writes. The first takes its place last, and says that the step is done.
    pub outputs: Vec<Output>,
    /// Where its words go.
    pub log: PathBuf,
    /// What its artefact will say of its origin, without the hashes of its inputs.
    pub provenance: Provenance,
    /// Processor time that it takes by the rates of [`super::estimate`] \[s\].
    pub cost_s: f64,
}

/// An artefact that a step reads.
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// Its name in the provenance of what is made of it.
    pub role: &'static str,
    /// Its place.
    pub path: PathBuf,
    /// Its kind.
    pub kind: Kind,
    /// The step that makes it; `None` = it was there before.
    pub from: Option<usize>,
}

/// A file or directory that a step writes.
#[derive(Clone, Debug, PartialEq)]
pub struct Output {
    /// Its place.
    pub path: PathBuf,
    /// What it is.
    pub kind: Kind,
}

impl Output {
    /// Whether it is a directory.
    pub fn is_directory(&self) -> bool {
        matches!(self.kind, Kind::Recordings | Kind::Datasets)
    }
}

impl Step {
    /// The output that says that the step is done.
    pub fn artefact(&self) -> &Path {
        &self.outputs[0].path
    }

    /// Whether all that it writes is there.
    pub fn is_there(&self) -> bool {
        self.outputs.iter().all(|output| output.path.exists())
    }

    /// The whole command line behind the name of the binary. No `hilt.toml` of where it runs changes a setting.
    pub fn command(&self, threads: &str) -> Vec<String> {
        let log = self.log.display().to_string();
        let more =
            ["--threads", threads, "--log", log.as_str(), "--config", "none", "--allow-dropped", "--quiet"].map(String::from);
        self.words.iter().cloned().chain(more).collect()
    }

    /// The steps that it needs.
    pub fn needs(&self) -> impl Iterator<Item = usize> + '_ {
        self.inputs.iter().filter_map(|input| input.from)
    }
}
