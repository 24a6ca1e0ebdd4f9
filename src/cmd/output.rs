//! Results on stdout.

use crate::error::{Error, Result};
use serde::Serialize;
use std::io::{ErrorKind, Write, stdout};
use std::path::Path;

/// Prints text. A reader that has seen enough (`| head`) is no error.
///
/// # Errors
/// [`Error::Io`] when stdout refuses for another reason, a full disk for one.
pub fn print(text: &str) -> Result<()> {
    let mut out = stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Error::io(Path::new("standard output"), "write", e)),
        _ => Ok(()),
    }
}

/// Prints a value as indented JSON with a line feed.
///
/// # Errors
/// As [`print`].
pub fn print_json(value: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(value).map_err(|e| Error::Failed(format!("cannot write JSON: {e}")))?;
    print(&format!("{text}\n"))
}
