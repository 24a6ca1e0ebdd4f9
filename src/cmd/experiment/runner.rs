//! Runs the steps that are not done, several side by side, each as soon as those that it needs are done.

use super::checked::Checked;
use super::lock::Lock;
use super::{child, output};
use crate::cmd::{Context, Outcome};
use crate::data::ContentHash;
use crate::error::{Error, Result};
use crate::experiment::estimate::{Estimate, in_words};
use crate::experiment::state::{Contents, look, states};
use crate::guard::guarded;
use std::path::PathBuf;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Failed steps that are named one by one; the rest is counted.
const NAMED: usize = 10;

pub fn run(checked: &Checked, contents: Contents, lock: Lock, context: &Context) -> Result<Outcome> {
    let binary = child::own_binary()?;
    let left = contents.iter().filter(|content| content.is_none()).count();
    announce(checked, &contents, left, context);
    let runner =
        Runner { checked, binary, lock, context, progress: Mutex::new(Progress::new(contents, left)), changed: Condvar::new() };
    let workers = checked.jobs.min(left);
    std::thread::scope(|scope| (0..workers).for_each(|_| drop(scope.spawn(|| runner.work()))));
    let Progress { contents, failed, .. } = runner.progress.into_inner().unwrap_or_else(PoisonError::into_inner);
    let done = contents.iter().flatten().count();
    let (all, dir) = (checked.grid.steps.len(), checked.dir.display());
    if context.interrupt.is_raised() {
        return Err(Error::InterruptedAt(format!("{done} of {all} steps are done in {dir}: run the same command to go on")));
    }
    if failed.is_empty() {
        output::collect(checked, &contents, context)?;
        return Ok(Outcome::Done);
    }
    output::write(checked, &contents)?;
    Err(failures(checked, &failed, all - done - failed.len()))
}

fn announce(checked: &Checked, contents: &Contents, left: usize, context: &Context) {
    let (name, all, jobs, threads) = (&checked.experiment.name, contents.len(), checked.jobs, checked.threads);
    let states = states(&checked.grid, contents);
    let (seconds, _) = Estimate::of(&checked.grid, &states, threads).of_all(&checked.grid, &states, jobs);
    let runs = checked.grid.runs.len();
    let takes =
        if left > 0 { format!(", about {} (--jobs {jobs}, {threads} threads each)", in_words(seconds)) } else { String::new() };
    context.console.say(&format!("experiment {name}: {runs} runs, {left} of {all} steps to do{takes}"));
}

fn failures(checked: &Checked, failed: &[(usize, String)], left_out: usize) -> Error {
    let mut failed = failed.to_vec();
    failed.sort();
    let lines = failed.iter().take(NAMED).map(|(step, why)| {
        let step = &checked.grid.steps[*step];
        format!("\n{}: {why}\n  log: {}", step.id, step.log.display())
    });
    let more = if failed.len() > NAMED { format!("\nand {} more", failed.len() - NAMED) } else { String::new() };
    let count = failed.len();
    let others = if left_out > 0 { format!(", {left_out} that need them were left out") } else { String::new() };
    let lines: String = lines.collect();
    Error::Failed(format!(
        "steps that failed: {count}{others}; all others are done, the same command tries these again{lines}{more}"
    ))
}

/// What is known of all steps.
struct Progress {
    contents: Contents,
    begun: Vec<bool>,
    running: usize,
    /// Steps that were to be done, and how many have been.
    total: usize,
    finished: usize,
    failed: Vec<(usize, String)>,
}

impl Progress {
    fn new(contents: Contents, total: usize) -> Self {
        let begun = contents.iter().map(Option::is_some).collect();
        Progress { contents, begun, running: 0, total, finished: 0, failed: Vec::new() }
    }
}

struct Runner<'a> {
    checked: &'a Checked<'a>,
    binary: PathBuf,
    lock: Lock,
    context: &'a Context,
    progress: Mutex<Progress>,
    /// A step has ended.
    changed: Condvar,
}

impl Runner<'_> {
    fn progress(&self) -> MutexGuard<'_, Progress> {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes steps until there are none.
    fn work(&self) {
        while let Some((step, contents)) = self.next() {
            let began = Instant::now();
            // A panic that ended this thread would leave the others waiting for it.
            let result = guarded(|| self.step(step, &contents)).unwrap_or_else(|panic| Err(Error::Failed(panic)));
            let mut progress = self.progress();
            progress.running -= 1;
            if !self.context.interrupt.is_raised() {
                let seconds = began.elapsed().as_secs_f64();
                progress.finished += 1;
                let (at, total, id) = (progress.finished, progress.total, &self.checked.grid.steps[step].id);
                match result {
                    Ok(content) => {
                        progress.contents[step] = Some(content);
                        self.context.console.say(&format!("{at}/{total} {id}: {seconds:.1} s"));
                    }
                    Err(why) => {
                        self.context.console.say(&format!("{at}/{total} {id}: failed"));
                        progress.failed.push((step, why.to_string()));
                    }
                }
            }
            drop(progress);
            self.changed.notify_all();
        }
    }

    /// The first step that can begin; waits for those at work while there may be one. `None` = there is nothing left to do.
    fn next(&self) -> Option<(usize, Contents)> {
        let mut progress = self.progress();
        loop {
            if self.context.interrupt.is_raised() {
                return None;
            }
            let ready =
                |i: &usize| !progress.begun[*i] && self.checked.grid.steps[*i].needs().all(|n| progress.contents[n].is_some());
            let found = (0..progress.begun.len()).find(ready);
            if let Some(step) = found {
                progress.begun[step] = true;
                progress.running += 1;
                return Some((step, progress.contents.clone()));
            }
            if progress.running == 0 {
                return None;
            }
            progress = self.changed.wait(progress).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Runs a step unless its artefact is there: it could not be told while an input was missing.
    fn step(&self, step: usize, contents: &Contents) -> Result<ContentHash> {
        let step = &self.checked.grid.steps[step];
        if let Some(content) = look(step, contents)? {
            return Ok(content);
        }
        child::run(&self.binary, step, self.checked.threads, &self.lock, self.context)?;
        let missing = || Error::input(step.artefact(), "is not there, or damaged, though its step has ended well");
        look(step, contents)?.ok_or_else(missing)
    }
}
