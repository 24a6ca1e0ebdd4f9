//! A tiny sweep, and what its directory holds.

use crate::files::{contents, text};
use std::collections::BTreeMap;
use std::fs;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use tempfile::TempDir;

/// The binary under test.
pub const HILT: &str = env!("CARGO_BIN_EXE_hilt");
/// Where the sweep of [`TINY`] goes.
pub const DIR: &str = "runs/experiments/tiny";
/// Two seeds of three runs, which share demos and dynamics network.
pub const TINY: &str = r#"
description = "tiny"
tasks = ["pick-up"]
methods = ["hil", "bc"]
seeds = [11, 12]
episodes = 2
set = [
    "plan.episodes=4", "pretrain.epochs=2", "pretrain.hidden_units=16", "train.hidden_units=16", "train.warm_start_updates=10",
    "train.epochs=1", "train.min_updates=0", "evaluate.horizon_steps=40",
]

[[variation]]
name = "plain"

[[variation]]
name = "rho-0.6"
set = ["train.rho=0.6"]
methods = ["hil"]
"#;
/// Its steps: plan, simulate, convert, pretrain, three trainings and their evaluations for each seed.
pub const STEPS: usize = 20;

/// A directory with an experiment's file in it, in which commands run.
pub struct Sweep {
    dir: TempDir,
}

impl Sweep {
    /// With this text as `tiny.toml`.
    pub fn new(text: &str) -> Self {
        let sweep = Sweep { dir: tempfile::tempdir().expect("temporary directory") };
        sweep.edit(text);
        sweep
    }

    /// Another text for the file.
    pub fn edit(&self, text: &str) {
        fs::write(self.at("tiny.toml"), text).expect("written");
    }

    /// A path in the directory.
    pub fn at(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn command(&self, flags: &[&str]) -> Command {
        let mut command = Command::new(HILT);
        command.args(["experiment", "tiny.toml"]).args(flags).current_dir(self.dir.path());
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    /// Runs the experiment to its end.
    pub fn run(&self, flags: &[&str]) -> Output {
        self.command(flags).output().expect("the binary runs")
    }

    /// Runs it; it must succeed. Its words.
    pub fn done(&self, flags: &[&str]) -> String {
        let output = self.run(flags);
        assert_eq!(output.status.code(), Some(0), "{flags:?}: {}", text(&output.stderr));
        text(&output.stderr)
    }

    /// Begins it.
    pub fn start(&self, flags: &[&str]) -> Child {
        // A group of its own, with the steps that it begins: they can be killed together.
        self.command(flags).process_group(0).spawn().expect("the binary runs")
    }

    /// Runs it; it must be refused with all of `says` in one error, and leave all files as they are.
    pub fn refuses(&self, flags: &[&str], says: &[&str]) {
        let before = contents(self.dir.path());
        let output = self.run(flags);
        let stderr = text(&output.stderr);
        assert!(matches!(output.status.code(), Some(1 | 2)), "{flags:?}: {:?} {stderr}", output.status);
        assert_eq!(stderr.lines().filter(|l| l.starts_with("error: ")).count(), 1, "{stderr}");
        assert!(says.iter().all(|part| stderr.contains(part)), "should say {says:?}: {stderr}");
        assert!(contents(self.dir.path()) == before, "{flags:?} changed files");
    }

    /// The files that must not depend on when and how the sweep ran.
    pub fn results(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        let mut files = contents(&self.at(DIR));
        files.retain(|name, _| {
            let top = name.components().next().map(|c| c.as_os_str().to_string_lossy().into_owned()).unwrap_or_default();
            top != "logs" && top != "times.csv" && !top.starts_with('.')
        });
        files
    }
}

/// Two directories hold the same.
pub fn same(one: &BTreeMap<PathBuf, Vec<u8>>, other: &BTreeMap<PathBuf, Vec<u8>>) {
    assert_eq!(one.keys().collect::<Vec<_>>(), other.keys().collect::<Vec<_>>());
    let differs: Vec<_> = one.iter().filter(|(name, bytes)| other[*name] != **bytes).map(|(name, _)| name).collect();
    assert!(differs.is_empty(), "other bytes: {differs:?}");
}
