//! What `make all` has noted of a stage: `settings/STAGE.toml`, with the sizes of the stage's files, by the rules of pipelines/made.sh.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Stands between a stage's settings and the sizes of its files.
const SIZES_FOLLOW: &str = "# bytes left in place:";

/// The notes on one stage of the run in `dir`.
pub(super) struct Stamp {
    path: PathBuf,
    /// Files below the run's directory and how large they were left \[bytes\].
    files: Vec<(PathBuf, u64)>,
    begun: PathBuf,
}

impl Stamp {
    /// Of a stage by the name that make gives it (`train-bc`); `None` where make has left none.
    pub(super) fn read(dir: &Path, name: &str) -> Option<Self> {
        let path = dir.join("settings").join(format!("{name}.toml"));
        let text = fs::read_to_string(&path).ok()?;
        let (_, sizes) = text.split_once(SIZES_FOLLOW)?;
        let file = |line: &str| {
            let (bytes, name) = line.strip_prefix("# ")?.split_once(' ')?;
            Some((dir.join(name), bytes.parse().ok()?))
        };
        let files = sizes.lines().filter_map(file).collect();
        Some(Stamp { begun: dir.join("settings").join(format!(".{name}.begun")), path, files })
    }

    /// Why make would run the stage again, whatever its settings: `before` are the files of the stage before.
    pub(super) fn stale(&self, before: &[PathBuf]) -> Option<&'static str> {
        let time = |path: &Path| fs::metadata(path).and_then(|found| found.modified()).ok();
        let any = |files: &mut dyn Iterator<Item = &PathBuf>, since: Option<SystemTime>, same: bool| {
            files.filter_map(|file| time(file)).any(|at| since.is_some_and(|since| at > since || same && at == since))
        };
        if any(&mut self.files.iter().map(|(file, _)| file), time(&self.begun), true) {
            return Some("it was stopped while it was put in place");
        }
        any(&mut before.iter(), time(&self.path), false)
            .then_some("what it was made from is newer: changed by hand since, or copied without its times")
    }

    /// Whether the files have the sizes that make left them with.
    pub(super) fn as_left(&self) -> bool {
        self.files.iter().all(|(file, bytes)| fs::metadata(file).is_ok_and(|found| found.len() == *bytes))
    }

    /// The files of the stage.
    pub(super) fn files(&self) -> Vec<PathBuf> {
        self.files.iter().map(|(file, _)| file.clone()).collect()
    }
}
