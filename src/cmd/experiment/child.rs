//! A step as a process of its own.

use super::lock::Lock;
use crate::cmd::Context;
use crate::error::{Error, Result};
use crate::experiment::Step;
use rustix::process::{Pid, Signal, kill_process};
use std::fs::File;
use std::io::{Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::sleep;
use std::time::Duration;

/// How often a step is asked whether it has ended.
const TICK: Duration = Duration::from_millis(10);

/// The program that runs steps: this one.
///
/// # Errors
/// [`Error::Failed`] when the system does not tell where it is.
pub fn own_binary() -> Result<PathBuf> {
    std::env::current_exe().map_err(|e| Error::Failed(format!("cannot find the own binary: {e}")))
}

/// Runs a step to its end; `Err` has the last words of one that failed. An interrupt is passed on to it, once.
pub fn run(binary: &Path, step: &Step, threads: usize, lock: &Lock, context: &Context) -> Result<()> {
    let unfit = |e: std::io::Error| Error::Failed(format!("{} cannot be started: {e}", binary.display()));
    // A file, not a pipe: nobody has to read it while the step works.
    let mut words = tempfile::tempfile().map_err(unfit)?;
    let mut command = Command::new(binary);
    command.args(step.command(&threads.to_string())).stdin(lock.held()?).stdout(Stdio::null());
    let mut child = command.stderr(Stdio::from(words.try_clone().map_err(unfit)?)).spawn().map_err(unfit)?;
    let status = wait(&mut child, context).map_err(unfit)?;
    context.interrupt.check()?;
    if status.success() {
        return Ok(());
    }
    let mut said = String::new();
    // What is no text is no word.
    let _ = words.rewind().and_then(|()| words.read_to_string(&mut said));
    let said = said.trim_end().trim_start_matches("error: ");
    let said = if said.is_empty() { format!("ended with {status}") } else { said.to_string() };
    note(&step.log, &said);
    Err(Error::Failed(said))
}

fn wait(child: &mut Child, context: &Context) -> std::io::Result<ExitStatus> {
    let mut told = false;
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(status);
        }
        if let Some(signal) = context.interrupt.signal().filter(|_| !told) {
            told = true;
            let (pid, signal) = (Pid::from_child(child), Signal::from_named_raw(signal).unwrap_or(Signal::TERM));
            // It may have ended by itself.
            let _ = kill_process(pid, signal);
        }
        sleep(TICK);
    }
}

/// The error goes into the step's log too, where people look.
fn note(log: &Path, said: &str) {
    if let Ok(mut file) = File::options().create(true).append(true).open(log) {
        let _ = writeln!(file, "error: {said}");
    }
}
