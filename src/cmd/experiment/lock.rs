//! One process works on an experiment at a time; steps that outlive a killed one are waited for.

use crate::cmd::Context;
use crate::error::{Error, Result};
use std::fs::{self, File, TryLockError};
use std::path::Path;
use std::process::Stdio;
use std::thread::sleep;
use std::time::Duration;

/// Locked by the process that runs the experiment.
const RUNNER: &str = ".runner.lock";
/// Locked by it and by each of its steps: they have it as their standard input, and the lock lives as long as one of them.
const STEPS: &str = ".steps.lock";
/// How often is looked whether the steps of a killed process have ended.
const TICK: Duration = Duration::from_millis(50);

/// The right to run steps of an experiment.
pub struct Lock {
    _runner: File,
    steps: File,
}

impl Lock {
    /// Takes it; creates the directory.
    ///
    /// # Errors
    /// [`Error::Failed`] when another process runs this experiment; [`Error::Io`] when the system refuses; [`Error::Interrupted`].
    pub fn take(dir: &Path, context: &Context) -> Result<Self> {
        fs::create_dir_all(dir).map_err(|e| Error::io(dir, "create", e))?;
        let runner = open(&dir.join(RUNNER))?;
        match runner.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                let dir = dir.display();
                return Err(Error::Failed(format!(
                    "another process runs the experiment in {dir}: wait for it, or give another --dir"
                )));
            }
            Err(TryLockError::Error(e)) => return Err(Error::io(dir, "lock", e)),
        }
        let steps = open(&dir.join(STEPS))?;
        let mut said = false;
        while let Err(TryLockError::WouldBlock) = steps.try_lock() {
            if !said {
                context.console.say("experiment: waits for steps that a killed run has left at work");
                said = true;
            }
            context.interrupt.check()?;
            sleep(TICK);
        }
        steps.lock_shared().map_err(|e| Error::io(dir, "lock", e))?;
        Ok(Lock { _runner: runner, steps })
    }

    /// The standard input of a step, which holds the lock.
    ///
    /// # Errors
    /// [`Error::Failed`] when the system refuses.
    pub fn held(&self) -> Result<Stdio> {
        self.steps.try_clone().map(Stdio::from).map_err(|e| Error::Failed(format!("cannot hand the lock to a step: {e}")))
    }
}

fn open(path: &Path) -> Result<File> {
    File::options().create(true).write(true).truncate(false).read(true).open(path).map_err(|e| Error::io(path, "create", e))
}
