//! Words and progress on stderr: bars on a terminal, plain lines otherwise; with `--log`, the plain lines in a file as well.

use super::output::can_move;
use crate::error::{Error, Result};
use crate::interrupt;
use console::{Term, style};
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::fs::File;
use std::io::{IsTerminal, Write, stderr};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, OnceLock};
use std::time::Instant;

/// Plain progress lines per stage.
const PLAIN_LINES: u64 = 10;

/// Where words go.
#[derive(Debug)]
pub struct Console {
    quiet: bool,
    log_path: Option<PathBuf>,
    /// A log that is there already is not emptied.
    goes_on: bool,
    /// Open once the command's places are checked: it may not be one of its inputs.
    log: OnceLock<Mutex<File>>,
    bars: MultiProgress,
}

impl Console {
    /// `quiet` keeps stderr for errors; [`Console::open_log`] begins the log.
    pub fn new(quiet: bool, log: Option<&Path>, goes_on: bool) -> Self {
        let show_bars = !quiet && stderr().is_terminal() && can_move();
        let target = if show_bars { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let (log_path, log) = (log.map(Path::to_path_buf), OnceLock::new());
        Console { quiet, log_path, goes_on, log, bars: MultiProgress::with_draw_target(target) }
    }

    /// Where the log is to be.
    pub fn log_path(&self) -> Option<&Path> {
        self.log_path.as_deref()
    }

    /// Creates the log, with the directories above it; an old one is emptied, or goes on.
    ///
    /// # Errors
    /// [`Error::Io`] when it cannot be created.
    pub fn open_log(&self) -> Result<()> {
        if let Some(path) = &self.log_path {
            let file = open(path, self.goes_on)?;
            self.log.get_or_init(|| Mutex::new(file));
        }
        Ok(())
    }

    /// A line for people. Nobody is told when stderr or a full disk refuses it: words are no result.
    pub fn say(&self, line: &str) {
        self.to_log(line);
        if !self.quiet {
            self.bars.suspend(|| {
                let _ = writeln!(stderr(), "{}", styled(line));
            });
        }
    }

    /// The last line of the log of a command that failed; stderr has it from who ends the process.
    pub fn log_error(&self, why: &Error) {
        self.to_log(&format!("error: {why}"));
    }

    fn to_log(&self, line: &str) {
        if let Some(mut log) = self.log.get().and_then(|log| log.lock().ok()) {
            let _ = writeln!(log, "{line}");
        }
    }

    /// Begins to count `total` items of work, called `unit` ("plans").
    pub fn progress(&self, stage: &str, total: u64, unit: &'static str) -> Progress<'_> {
        let bar = (!self.bars.is_hidden()).then(|| {
            let style =
                ProgressStyle::with_template(&template(Term::stderr().size().1)).expect("the template of the bar is well formed");
            self.bars.add(ProgressBar::new(total).with_style(style).with_prefix(stage.to_string()).with_message(unit))
        });
        Progress {
            console: self,
            stage: stage.into(),
            unit,
            total,
            bar,
            before: 0,
            done: AtomicU64::new(0),
            started: Instant::now(),
        }
    }
}

/// The stage that a line is about, bold where the terminal shows it.
fn styled(line: &str) -> String {
    match line.split_once(": ") {
        Some((stage, rest)) if !stage.contains(' ') => format!("{}: {rest}", style(stage).for_stderr().bold()),
        _ => line.into(),
    }
}

/// A terminal with fewer columns has no room for a bar.
const NARROW_COLUMNS: u16 = 60;

/// The line of a bar for a terminal of so many columns: its words take what is left, and are cut there.
fn template(columns: u16) -> String {
    let bar = if columns < NARROW_COLUMNS { String::new() } else { format!("{{bar:{}.cyan/dim}} ", columns / 5) };
    format!("{{prefix:.bold}} {bar}{{pos}}/{{len}} {{wide_msg}} eta {{eta}}")
}

fn open(path: &Path, goes_on: bool) -> Result<File> {
    let io = |e| Error::io(path, "create", e);
    if let Some(parent) = path.parent() {
        std::fs::create_dir_all(parent).map_err(io)?;
    }
    let _waits = interrupt::waiting();
    File::options().create(true).write(true).append(goes_on).truncate(!goes_on).open(path).map_err(io)
}

/// Counts items of work, from any thread.
#[derive(Debug)]
pub struct Progress<'a> {
    console: &'a Console,
    stage: String,
    unit: &'static str,
    total: u64,
    bar: Option<ProgressBar>,
    /// Items that an earlier process has done.
    before: u64,
    done: AtomicU64,
    started: Instant,
}

impl Progress<'_> {
    /// The work began earlier, at `started`.
    pub fn since(mut self, started: Instant) -> Self {
        self.started = started;
        self
    }

    /// An earlier process has done so many of the items.
    pub fn after(mut self, items: u64) -> Self {
        if let Some(bar) = &self.bar {
            bar.set_position(items);
        }
        (self.before, self.done) = (items, AtomicU64::new(items));
        self
    }

    /// One more item is done.
    pub fn step(&self) {
        self.step_with("");
    }

    /// One more item is done; `more` words say how it stands.
    pub fn step_with(&self, more: &str) {
        self.show(self.done.fetch_add(1, Ordering::Relaxed), 1, more);
    }

    /// So many items are done by now; `more` words say how it stands.
    pub fn reach(&self, done: u64, more: &str) {
        let before = self.done.fetch_max(done, Ordering::Relaxed);
        self.show(before, done.saturating_sub(before), more);
    }

    fn show(&self, before: u64, new: u64, more: &str) {
        let (done, total) = (before + new, self.total.max(1));
        if let Some(bar) = &self.bar {
            bar.set_message(format!("{}{more}", self.unit));
            bar.inc(new);
        } else if done < total && done * PLAIN_LINES / total != before * PLAIN_LINES / total {
            self.console.say(&format!("{}: {done}/{total} {}{more}", self.stage, self.unit));
        }
    }

    /// The stage is over: its wall time and rate, and `more` words.
    pub fn finish(self, more: &str) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
        let seconds = self.started.elapsed().as_secs_f64();
        let done = self.done.load(Ordering::Relaxed) - self.before;
        let rate = done as f64 / seconds.max(f64::MIN_POSITIVE);
        self.console.say(&format!("{}: {done} {} in {seconds:.1} s ({rate:.1} per second){more}", self.stage, self.unit));
    }
}

impl Drop for Progress<'_> {
    /// What ends early leaves no bar behind.
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_leaves_room_for_what_it_counts_on_every_terminal() {
        for columns in [1, 40, 59, 60, 80, 99, 100, 200, u16::MAX] {
            assert!(ProgressStyle::with_template(&template(columns)).is_ok(), "{columns}");
        }
        assert!(!template(40).contains("bar") && template(80).contains("{bar:16"), "{}", template(80));
    }
}
