//! Metrics for who watches a training: a line of JSON an epoch, and TensorBoard's events. Opt-in; the table that training ends with is the artefact.

use super::Console;
use super::places::{Content, Places};
use crate::data::{live_file, tensorboard};
use crate::error::{Error, Result};
use crate::interrupt;
use crate::learn::{Checkpoint, EpochMetrics, Metric};
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Where to.
#[derive(Debug, clap::Args)]
pub struct LiveArgs {
    /// Write metrics as they come too, a line of JSON an epoch; hilt plot --watch draws them. A resumed training goes on in it
    #[arg(long, value_name = "FILE.jsonl")]
    live: Option<PathBuf>,
    /// Write metrics as they come as an event file of TensorBoard's into this directory: tensorboard --logdir DIR
    #[arg(long, value_name = "DIR")]
    tensorboard: Option<PathBuf>,
}

impl LiveArgs {
    /// Adds what is written.
    pub fn places(&self, places: Places) -> Places {
        let places = self.live.iter().fold(places, |places, path| places.write("--live", path, Content::Live));
        self.tensorboard.iter().fold(places, |places, path| places.write("--tensorboard", path, Content::Events))
    }
}

/// The files that are open.
pub struct Live<'a> {
    /// The stage that writes them.
    stage: &'static str,
    console: &'a Console,
    lines: Option<(PathBuf, File)>,
    events: Option<(PathBuf, File)>,
    steps: tensorboard::Steps,
}

impl<'a> Live<'a> {
    /// Begins the files anew; a resumed training writes the epochs of its checkpoint first, so that none is there twice and none is missing.
    ///
    /// # Errors
    /// [`Error::Io`] when a file cannot be created or written; [`Error::Failed`] for a checkpoint whose epochs cannot be read.
    pub fn begin(
        stage: &'static str,
        args: &LiveArgs,
        resume: Option<&Checkpoint>,
        metrics: &[Metric],
        console: &'a Console,
    ) -> Result<Self> {
        let events = args.tensorboard.as_deref().map(|dir| dir.join(tensorboard::FILE));
        let lines = args.live.clone().map(open).transpose()?;
        let events = events.map(open).transpose()?;
        let mut live = Live { stage, console, lines, events, steps: tensorboard::Steps::default() };
        if let Some((path, file)) = &mut live.events {
            file.write_all(&tensorboard::head()).map_err(|e| Error::io(path, "write", e))?;
        }
        let rows = resume.map(Checkpoint::rows).transpose();
        let rows = rows.map_err(|why| Error::Failed(format!("the checkpoint does not fit: {why}")))?;
        rows.iter().flatten().for_each(|row| live.step(row, metrics));
        Ok(live)
    }

    /// One more epoch is done. A disk that refuses does not stop training: it is told, and the file is closed.
    pub fn step(&mut self, epoch: &EpochMetrics, metrics: &[Metric]) {
        let values = metrics.iter().map(|metric| (metric.name, epoch.get(metric.name)));
        if self.lines.is_some() {
            let line = live_file::line(&epoch.stage, [epoch.epoch, epoch.epochs], epoch.updates, values);
            append(&mut self.lines, line.as_bytes(), (self.stage, self.console));
        }
        if self.events.is_some() {
            let scalars: Vec<tensorboard::Scalar> =
                metrics.iter().map(|metric| (metric.name, metric.doc, epoch.get(metric.name))).collect();
            append(&mut self.events, &self.steps.next(&scalars), (self.stage, self.console));
        }
    }
}

fn append(open: &mut Option<(PathBuf, File)>, bytes: &[u8], (stage, console): (&str, &Console)) {
    let Some((path, file)) = open else { return };
    if let Err(why) = file.write_all(bytes) {
        console.say(&format!("{stage}: {}: cannot write: {why}; training goes on without it", path.display()));
        *open = None;
    }
}

fn open(path: PathBuf) -> Result<(PathBuf, File)> {
    let made = |path: &Path| {
        if let Some(parent) = path.parent().filter(|parent| !parent.as_os_str().is_empty()) {
            fs::create_dir_all(parent)?;
        }
        let _waits = interrupt::waiting();
        File::create(path)
    };
    let file = made(&path).map_err(|e| Error::io(&path, "create", e))?;
    Ok((path, file))
}
