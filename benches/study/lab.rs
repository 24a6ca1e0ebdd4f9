//! Runs `hilt` stages once: a step's directory is named by everything that decides what is in it.

use anyhow::{Context, Result, bail, ensure};
use hilt::config::{Pipeline, Source, Stage};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// The binary under study.
const HILT: &str = env!("CARGO_BIN_EXE_hilt");
/// Stands for the step's own directory in a command.
pub const OUT: &str = "{out}";
/// The last file of a step: with it, the step is whole. Holds processor and wall seconds.
const MARK: &str = "seconds";
/// Hex digits of the hash in a directory's name.
const KEY_DIGITS: usize = 12;
/// Done, but episodes were dropped (they are counted by whoever needs them all).
const DROPPED_CODE: i32 = 3;

/// A pipeline file, what overrides it, and the seed.
#[derive(Clone, Debug)]
pub struct Setup {
    pub pipeline: PathBuf,
    pub sets: Vec<String>,
    pub seed: u64,
}

impl Setup {
    /// With further overrides, which win.
    pub fn with(&self, sets: &[String]) -> Setup {
        Setup { sets: [&self.sets, sets].concat(), ..self.clone() }
    }

    /// The resolved settings.
    pub fn resolve(&self) -> Result<Pipeline> {
        Ok(Pipeline::load(&Source::File(self.pipeline.clone(), None), &self.sets)?)
    }
}

/// A finished step.
#[derive(Clone, Debug)]
pub struct Done {
    pub label: String,
    pub dir: PathBuf,
    /// Processor time \[s\]: on one thread the wall time of a free processor, whatever else runs beside it.
    pub cpu_s: f64,
    /// Wall time \[s\].
    pub wall_s: f64,
}

/// Where and how steps run.
#[derive(Clone, Debug)]
pub struct Lab {
    pub dir: PathBuf,
    pub threads: usize,
}

impl Lab {
    /// Runs stages, each with further words of its command line, unless that has been done. `scratch` is removed from the step's
    /// directory in the end. Inputs are named by their directories, whose names carry their own hashes.
    pub fn step(&self, label: &str, setup: &Setup, stages: &[(Stage, Vec<String>)], scratch: &[&str]) -> Result<Done> {
        let mut hash = blake3::Hasher::new();
        hash.update(&setup.seed.to_le_bytes());
        for (stage, words) in stages {
            hash.update(setup.resolve()?.to_toml(Some(*stage))?.as_bytes());
            hash.update(format!("{} {words:?} {scratch:?}", stage.name()).as_bytes());
        }
        let dir = self.dir.join(format!("{label}.{}", &hash.finalize().to_hex()[..KEY_DIGITS]));
        if let Ok(mark) = fs::read_to_string(dir.join(MARK)) {
            let mut seconds = mark.split_whitespace().map(str::parse);
            let (Some(Ok(cpu_s)), Some(Ok(wall_s))) = (seconds.next(), seconds.next()) else {
                bail!("{} does not hold two numbers; remove {}", dir.join(MARK).display(), dir.display());
            };
            return Ok(Done { label: label.into(), dir, cpu_s, wall_s });
        }
        // What a killed run left behind.
        if dir.exists() {
            fs::remove_dir_all(&dir)?;
        }
        fs::create_dir_all(&dir).with_context(|| format!("cannot make {}", dir.display()))?;
        let (mut cpu_s, mut wall_s) = (0.0, 0.0);
        for (stage, words) in stages {
            let [cpu, wall] = self.stage(*stage, setup, words, &dir)?;
            (cpu_s, wall_s) = (cpu_s + cpu, wall_s + wall);
        }
        for name in scratch {
            let path = dir.join(name);
            if path.is_dir() { fs::remove_dir_all(path)? } else { fs::remove_file(path)? }
        }
        fs::write(dir.join(MARK), format!("{cpu_s} {wall_s}\n"))?;
        eprintln!("{label}: {cpu_s:.1} s of processor time, {wall_s:.1} s");
        Ok(Done { label: label.into(), dir, cpu_s, wall_s })
    }

    /// Runs one stage; processor and wall time \[s\], from bash's own `time`.
    fn stage(&self, stage: Stage, setup: &Setup, words: &[String], dir: &Path) -> Result<[f64; 2]> {
        let log = dir.join("log");
        let mut command = Command::new("bash");
        command.env("LC_ALL", "C");
        command.args(["-c", "TIMEFORMAT='%U %S %R'; time \"$@\" >>\"$0\" 2>&1"]).arg(&log).arg(HILT).arg(stage.name());
        command.arg("--pipeline").arg(&setup.pipeline).args(["--seed", &setup.seed.to_string()]);
        command.args(["--threads", &self.threads.to_string()]);
        command.args(setup.sets.iter().flat_map(|set| ["--set", set]));
        let own = dir.to_str().context("the directory's name is not UTF-8")?;
        command.args(words.iter().map(|word| word.replace(OUT, own)));
        let output = command.output().context("bash does not start")?;
        if !matches!(output.status.code(), Some(0 | DROPPED_CODE)) {
            bail!("hilt {} ended with {}; its words are in {}", stage.name(), output.status, log.display());
        }
        let text = String::from_utf8_lossy(&output.stderr);
        let times: Vec<f64> = text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        ensure!(times.len() == 3, "bash's time says \"{}\", not three numbers", text.trim());
        Ok([times[0] + times[1], times[2]])
    }
}

/// Works through `cells`, `jobs` at a time; results in the order of the cells. `done` sees the results so far after each cell.
/// The first error ends it after the cells in progress.
pub fn each<C: Sync, R: Send + Clone>(
    cells: &[C],
    jobs: usize,
    work: impl Fn(&C) -> Result<R> + Sync,
    done: impl Fn(&[R]) -> Result<()> + Sync,
) -> Result<()> {
    let (next, failed) = (AtomicUsize::new(0), AtomicBool::new(false));
    let results: Mutex<Vec<Option<R>>> = Mutex::new(vec![None; cells.len()]);
    let worker = || -> Result<()> {
        while !failed.load(Ordering::Relaxed) {
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some(cell) = cells.get(at) else { break };
            let made = work(cell).inspect_err(|_| failed.store(true, Ordering::Relaxed))?;
            let mut results = results.lock().expect("no worker panics with the results in hand");
            results[at] = Some(made);
            done(&results.iter().flatten().cloned().collect::<Vec<R>>())?;
        }
        Ok(())
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..jobs.max(1)).map(|_| scope.spawn(worker)).collect();
        workers.into_iter().try_for_each(|w| w.join().expect("a worker that panics is a mistake here"))
    })
}
