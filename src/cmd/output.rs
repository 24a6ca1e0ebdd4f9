//! Results on stdout.

use crate::error::{Error, Result};
use crate::report::table::text_table;
use crate::table::{Table, Values};
use serde::Serialize;
use std::env;
use std::io::{BufWriter, ErrorKind, IsTerminal, Write, stdout};
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

/// Whether the terminal that stdout is can be written to anywhere, and shows colours at all.
pub fn moves() -> bool {
    stdout().is_terminal() && can_move()
}

/// Whether the terminal, if there is one, can move its cursor: one without a name is taken for a simple one.
pub fn can_move() -> bool {
    env::var_os("TERM").is_some_and(|name| name != "dumb" && !name.is_empty())
}

/// Whether to write in colours: not where NO_COLOR says so (no-color.org), nor into a file.
pub fn colour() -> bool {
    moves() && env::var_os("NO_COLOR").is_none_or(|said| said.is_empty())
}

/// Whether the reader takes more than ASCII: by the language that is set, and not on a simple terminal.
pub fn unicode() -> bool {
    let said = ["LC_ALL", "LC_CTYPE", "LANG"].into_iter().find_map(|name| env::var(name).ok().filter(|said| !said.is_empty()));
    let utf8 = said.is_some_and(|said| said.to_lowercase().replace('-', "").ends_with("utf8"));
    // A pipe has no terminal's name, and may be read as anything.
    utf8 && (can_move() || env::var_os("TERM").is_none())
}

/// What stdout is called in errors.
pub const NAME: &str = "standard output";

/// Prints as it is made. A reader that has seen enough is no error.
///
/// # Errors
/// What `make` returns for another reason.
pub fn stream(make: impl FnOnce(&mut dyn Write) -> Result<()>) -> Result<()> {
    let mut out = BufWriter::new(stdout().lock());
    let made = make(&mut out);
    match made {
        Err(Error::Io { source, .. }) if source.kind() == ErrorKind::BrokenPipe => {
            // What is left is for nobody.
            drop(out.into_parts());
            Ok(())
        }
        other => other,
    }
}

/// Prints text. A reader that has seen enough (`| head`) is no error.
///
/// # Errors
/// [`Error::Io`] when stdout refuses for another reason, a full disk for one.
pub fn print(text: &str) -> Result<()> {
    let mut out = stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Error::io(Path::new(NAME), "write", e)),
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
