//! Ctrl-C as a value: long loops ask it between items and stop with [`Error::Interrupted`].

use crate::error::{Error, Result};
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicI32, AtomicUsize, Ordering};

/// A flag that a signal raises and that every long loop checks.
#[derive(Clone, Debug, Default)]
pub struct Interrupt(Arc<AtomicI32>);

impl Interrupt {
    /// Raises the flag for this signal number (not 0).
    pub fn raise(&self, signal: i32) {
        self.0.store(signal, Ordering::SeqCst);
    }

    /// The signal that raised the flag.
    pub fn signal(&self) -> Option<i32> {
        Some(self.0.load(Ordering::SeqCst)).filter(|signal| *signal != 0)
    }

    /// Whether the flag is up.
    pub fn is_raised(&self) -> bool {
        self.signal().is_some()
    }

    /// `Err(Interrupted)` once the flag is up.
    pub fn check(&self) -> Result<()> {
        if self.is_raised() { Err(Error::Interrupted) } else { Ok(()) }
    }
}

/// Threads of this process that wait for a file which may never answer: signals end a process, so this is the process's.
static WAITING: AtomicUsize = AtomicUsize::new(0);

/// Says that this thread waits for the system as long as the value lives: it opens, reads or hashes an input, or opens a pipe, and cannot
/// ask for an interrupt. Nothing of hilt's own is lost when the process ends there.
#[derive(Debug)]
pub struct Waiting(());

/// Begins to wait.
pub fn waiting() -> Waiting {
    WAITING.fetch_add(1, Ordering::SeqCst);
    Waiting(())
}

/// The bytes of what stands at `path`, a pipe too: at most `most`, and one more where there are more. It may be waited for, see [`waiting`].
///
/// # Errors
/// What the system says when it cannot be read.
pub fn read_at_most(path: &Path, most: u64) -> std::io::Result<Vec<u8>> {
    let _waits = waiting();
    let mut bytes = Vec::new();
    File::open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

impl Drop for Waiting {
    fn drop(&mut self) {
        WAITING.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Whether any thread waits.
pub fn anyone_waits() -> bool {
    WAITING.load(Ordering::SeqCst) > 0
}
