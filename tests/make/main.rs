//! `make` as a person uses it, in a copy of what it needs: what runs again and what does not, which variables it takes, what it removes.

mod artefacts;
mod binary;
mod inspected;
mod methods;
mod stopped;
mod variables;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;
use tempfile::TempDir;

/// Settings of a run that takes a second.
pub const TINY: &str = "plan.episodes=4 pretrain.epochs=2 pretrain.hidden_units=16 train.hidden_units=16 \
    train.warm_start_updates=10 train.epochs=1 train.min_updates=0 train.ppo.total_steps=200 train.ppo.worlds=8 train.ppo.steps=10 \
    evaluate.episodes=2 evaluate.horizon_steps=40";
/// Every stage.
pub const ALL: [&str; 6] = ["plan", "simulate", "convert", "pretrain", "train", "evaluate"];
/// Variables that would change what is tested, from the person's shell or from the `make` that runs the tests.
const OUTSIDE: [&str; 16] = [
    "MAKEFLAGS",
    "MAKELEVEL",
    "MFLAGS",
    "MAKEFILES",
    "CARGO_TARGET_DIR",
    "CARGO_BUILD_TARGET_DIR",
    "CARGO_BUILD_TARGET",
    "TASK",
    "RUNS",
    "SEED",
    "SET",
    "METHOD",
    "PRESET",
    "PIPELINE",
    "THREADS",
    "RESUME",
];

/// Copies with the times of the files.
pub fn copy(from: &Path, to: &Path) {
    let copied = Command::new("cp").arg("-Rp").args([from, to]).status().expect("cp runs");
    assert!(copied.success(), "{} was not copied", from.display());
}

/// What make needs, with the binary under test as the one that it has built.
pub fn tree() -> TempDir {
    let (root, dir) = (Path::new(env!("CARGO_MANIFEST_DIR")), tempfile::tempdir().expect("temporary directory"));
    for name in ["Makefile", "pipelines"] {
        copy(&root.join(name), &dir.path().join(name));
    }
    let release = dir.path().join("target/release");
    fs::create_dir_all(&release).expect("made");
    // Without its time: newer than what it is made of.
    fs::copy(env!("CARGO_BIN_EXE_hilt"), release.join("hilt")).expect("copied");
    dir
}

/// A call of `make` in `dir`.
pub fn command(dir: &Path, words: &[&str]) -> Command {
    let mut command = Command::new("make");
    for name in OUTSIDE {
        command.env_remove(name);
    }
    command.args(words).current_dir(dir).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Words of a process.
pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The files below a directory, the logs aside, which hold times.
pub fn contents(root: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let (mut found, mut open) = (BTreeMap::new(), vec![root.to_path_buf()]);
    while let Some(dir) = open.pop() {
        for path in fs::read_dir(&dir).expect("readable").map(|e| e.expect("entry").path()) {
            if path.is_dir() && !path.ends_with("logs") {
                open.push(path);
            } else if path.is_file() {
                found.insert(path.strip_prefix(root).expect("below").to_path_buf(), fs::read(&path).expect("readable"));
            }
        }
    }
    found
}

/// A finished run of pick-up, in a place of its own.
pub struct Run {
    /// Where `make` is called.
    pub tree: TempDir,
}

impl Run {
    /// A copy of a run that was made once.
    pub fn finished() -> Self {
        static WHOLE: OnceLock<TempDir> = OnceLock::new();
        let whole = WHOLE.get_or_init(|| {
            let run = Run { tree: tree() };
            assert_eq!(run.all(&[]), ALL);
            run.tree
        });
        let run = Run { tree: tree() };
        copy(&whole.path().join("runs"), &run.tree.path().join("runs"));
        run
    }

    /// A file of the run.
    pub fn at(&self, name: &str) -> PathBuf {
        self.tree.path().join("runs/pick-up").join(name)
    }

    /// All files of the run.
    pub fn contents(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        contents(&self.at(""))
    }

    /// `make all` with the tiny settings and these words.
    pub fn make(&self, words: &[&str]) -> Output {
        let set = format!("SET={TINY}");
        let words: Vec<&str> = ["all", &set].into_iter().chain(words.iter().copied()).collect();
        command(self.tree.path(), &words).output().expect("make runs")
    }

    /// The stages that `make all` ran; it must succeed.
    pub fn all(&self, words: &[&str]) -> Vec<String> {
        let output = self.make(words);
        assert!(output.status.success(), "{words:?}: {}", text(&output.stderr));
        stages(&output)
    }

    /// `make all` with one more override.
    pub fn with(&self, set: &str) -> Output {
        self.make(&[&format!("SET={TINY} {set}")])
    }
}

/// The stages that a call of make ran, by the commands that it printed.
pub fn stages(output: &Output) -> Vec<String> {
    let printed = text(&output.stdout);
    let words = printed.lines().filter_map(|line| line.strip_prefix("target/release/hilt "));
    words.filter_map(|words| words.split(' ').next().map(String::from)).collect()
}
