//! Tiny runs of all stages, and what must hold of a stage that refuses.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;
use tempfile::TempDir;

/// The binary under test.
pub const HILT: &str = env!("CARGO_BIN_EXE_hilt");
/// The stages that write, in order.
pub const STAGES: [&str; 6] = ["plan", "simulate", "convert", "pretrain", "train", "evaluate"];
/// Settings of a run that takes a second.
const TINY: [&str; 9] = [
    "plan.episodes=4",
    "pretrain.epochs=2",
    "pretrain.hidden_units=16",
    "train.hidden_units=16",
    "train.warm_start_updates=10",
    "train.epochs=1",
    "train.min_updates=0",
    "evaluate.episodes=2",
    "evaluate.horizon_steps=40",
];

/// A run of all stages under `dir`, of one task.
pub struct Run {
    dir: TempDir,
    /// The task.
    pub task: &'static str,
    /// The seed.
    pub seed: u64,
}

impl Run {
    /// An empty place for a run.
    pub fn new(task: &'static str, seed: u64) -> Self {
        Run { dir: tempfile::tempdir().expect("temporary directory"), task, seed }
    }

    /// All stages, with these further arguments.
    pub fn all(self, further: &[&str]) -> Self {
        for stage in STAGES {
            let words = self.words(stage).into_iter().chain(further.iter().map(|w| w.to_string())).collect();
            let output = hilt(words);
            assert!(matches!(output.status.code(), Some(0 | 3)), "{stage}: {}", text(&output.stderr));
        }
        self
    }

    /// A finished run to do harm to; each call copies the same one.
    pub fn finished() -> Self {
        static WHOLE: OnceLock<BTreeMap<PathBuf, Vec<u8>>> = OnceLock::new();
        let files = WHOLE.get_or_init(|| contents(Run::new("pick-up", 0).all(&[]).path()));
        let copy = Run::new("pick-up", 0);
        for (name, bytes) in files {
            let path = copy.at(name);
            fs::create_dir_all(path.parent().expect("below the run")).expect("made");
            fs::write(path, bytes).expect("copied");
        }
        copy
    }

    /// The directory.
    pub fn path(&self) -> &Path {
        self.dir.path()
    }

    /// A file of the run.
    pub fn at(&self, name: impl AsRef<Path>) -> PathBuf {
        self.dir.path().join(name)
    }

    /// The arguments of a stage, over the files of this run.
    pub fn words(&self, stage: &str) -> Vec<String> {
        let mut words: Vec<String> = [stage, "--task", self.task, "--seed", &self.seed.to_string()].map(String::from).to_vec();
        words.extend(TINY.iter().flat_map(|set| ["--set".to_string(), set.to_string()]));
        let files: &[(&str, &str)] = match stage {
            "plan" => &[("--out", "plans.parquet")],
            "simulate" => &[("--plans", "plans.parquet"), ("--out", "recordings")],
            "convert" => &[("--recordings", "recordings"), ("--out", "dataset")],
            "pretrain" => &[("--dataset", "dataset"), ("--out", "dynamics.safetensors")],
            "train" => &[("--dataset", "dataset"), ("--dynamics", "dynamics.safetensors"), ("--out", "policy.safetensors")],
            "evaluate" => &[("--policy", "policy.safetensors"), ("--out", "evaluation.json")],
            other => panic!("{other} is not a stage of the chain"),
        };
        words.extend(files.iter().flat_map(|(flag, name)| [flag.to_string(), self.name(name)]));
        words
    }

    /// The arguments that draw the first recording into `out`.
    pub fn render(&self, format: &str, out: &str) -> Vec<String> {
        vec!["render".into(), self.name("recordings/episode-00000.mcap"), format.into(), "--out".into(), self.name(out)]
    }

    /// A file's path as an argument.
    pub fn name(&self, name: &str) -> String {
        self.at(name).to_str().expect("UTF-8 path").to_string()
    }

    /// Runs a command that must be refused: exit code 1 or 2, one `error:` line with all of `says`, nothing printed, no file of the
    /// run changed, made or lost.
    pub fn refuses(&self, words: Vec<String>, says: &[&str]) {
        let before = contents(self.path());
        let output = hilt(words.clone());
        self.refused(&format!("{words:?}"), &output, &before, says);
    }

    /// What [`Run::refuses`] demands of an output.
    pub fn refused(&self, what: &str, output: &Output, before: &BTreeMap<PathBuf, Vec<u8>>, says: &[&str]) {
        let stderr = text(&output.stderr);
        assert!(matches!(output.status.code(), Some(1 | 2)), "{what}: {:?} {stderr}", output.status);
        assert!(output.stdout.is_empty(), "{what} printed to stdout");
        assert_eq!(stderr.lines().filter(|l| l.starts_with("error: ")).count(), 1, "{what}: {stderr}");
        for part in says {
            assert!(stderr.contains(part), "{what} should say \"{part}\": {stderr}");
        }
        self.unchanged(what, before);
    }

    /// The run holds these files, empty directories aside, and nothing else.
    pub fn unchanged(&self, what: &str, before: &BTreeMap<PathBuf, Vec<u8>>) {
        let after = contents(self.path());
        let names = |files: &BTreeMap<PathBuf, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
        assert_eq!(names(&after), names(before), "{what}: other files than before");
        for (name, bytes) in before {
            assert!(after[name] == *bytes, "{what}: {} was changed", name.display());
        }
    }
}

/// Runs the binary.
pub fn hilt(words: Vec<String>) -> Output {
    Command::new(HILT).args(words).output().expect("the binary runs")
}

/// All files below a directory; a directory with no file in it counts as a file without bytes.
pub fn contents(root: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let (mut found, mut open) = (BTreeMap::new(), vec![root.to_path_buf()]);
    while let Some(dir) = open.pop() {
        let entries: Vec<PathBuf> = fs::read_dir(&dir).expect("readable").map(|e| e.expect("entry").path()).collect();
        if entries.is_empty() {
            found.insert(dir.strip_prefix(root).expect("below").join(""), Vec::new());
        }
        for path in entries {
            if path.is_dir() {
                open.push(path);
            } else {
                found.insert(path.strip_prefix(root).expect("below").to_path_buf(), fs::read(&path).expect("readable"));
            }
        }
    }
    found
}

/// Words of the process.
pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}
