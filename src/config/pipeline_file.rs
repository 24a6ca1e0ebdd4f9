//! The text of a pipeline file, as a table.

use super::robot::is_file;
use crate::error::{Error, Result};
use crate::interrupt;
use crate::words::shown;
use std::path::Path;

/// A pipeline file with every key is 4 kB long; this leaves room for comments and boxes \[bytes\].
const LONGEST_FILE: u64 = 1 << 20;
/// The key outside of all sections that may be overridden.
pub(super) const ROBOT: &str = "robot";
/// The key of the task.
pub(super) const TASK: &str = "task";

/// The table in a pipeline file. The files of a robot and of a task are named relative to the one that names them.
pub(super) fn read_table(path: &Path) -> Result<toml::Table> {
    let mut own = parsed(&read(path)?, &path.display().to_string())?;
    for key in [ROBOT, TASK] {
        let said = own.get(key).and_then(toml::Value::as_str).filter(|said| is_file(said));
        if let Some(file) = said.map(|said| path.parent().unwrap_or(Path::new("")).join(said)) {
            own.insert(key.into(), file.display().to_string().into());
        }
    }
    Ok(own)
}

/// Puts `own` over `table`, key by key.
pub(super) fn lay_over(table: &mut toml::Table, own: toml::Table) {
    for (key, value) in own {
        match (table.get_mut(&key), value) {
            (Some(toml::Value::Table(inner)), toml::Value::Table(value)) => lay_over(inner, value),
            (_, value) => {
                table.insert(key, value);
            }
        }
    }
}

/// The table in a text.
pub(super) fn parsed(text: &str, origin: &str) -> Result<toml::Table> {
    text.parse().map_err(|e: toml::de::Error| {
        let why: Vec<String> = e.to_string().trim_end().lines().map(shown).collect();
        Error::Usage(format!("{origin} is not valid TOML: {}", why.join("\n")))
    })
}

/// Whatever stands at `path`, a pipe too, is read up to a limit.
fn read(path: &Path) -> Result<String> {
    let bytes = interrupt::read_at_most(path, LONGEST_FILE).map_err(|e| Error::io(path, "read", e))?;
    let refuse = |why: String| Error::Usage(format!("{} is not a pipeline file: {why}", path.display()));
    if bytes.len() as u64 > LONGEST_FILE {
        return Err(refuse(format!("it is longer than {LONGEST_FILE} bytes")));
    }
    String::from_utf8(bytes).map_err(|_| refuse("it is not UTF-8 text".into()))
}
