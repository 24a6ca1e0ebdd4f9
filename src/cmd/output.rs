//! Results on stdout.

use crate::error::{Error, Result};
use crate::report::table::text_table;
use crate::table::{Table, Values};
use serde::Serialize;
use std::io::{ErrorKind, Write, stdout};
use std::path::Path;

/// Characters of a line on the terminal that stdout is; `None` where it is none: a file or a pipe takes lines of any length.
pub fn width() -> Option<usize> {
    size().map(|[width, _]| width)
}

/// The same with its lines.
pub fn size() -> Option<[usize; 2]> {
    let (width, height) = terminal_size::terminal_size_of(stdout())?;
    Some([width.0.into(), height.0.into()])
}

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

/// A table as text, numbers with four significant digits.
pub fn table_text(table: &Table) -> String {
    let header: Vec<&str> = table.columns.iter().map(|c| c.name.as_str()).collect();
    let cell = |values: &Values, row: usize| match values {
        Values::F32(v) => format!("{:.3e}", v[row]),
        Values::F64(v) => format!("{:.3e}", v[row]),
        Values::I64(v) => v[row].to_string(),
        Values::Bool(v) => v[row].to_string(),
        Values::Text(v) => v[row].clone(),
    };
    let rows: Vec<Vec<String>> =
        (0..table.rows()).map(|row| table.columns.iter().map(|c| cell(&c.values, row)).collect()).collect();
    text_table(&header, &rows)
}
