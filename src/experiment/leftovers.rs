//! Artefacts in an experiment's directory that none of its runs makes: the experiment was changed after it had begun.

use super::place::artefact_of;
use super::runs::Grid;
use crate::config::Stage;
use crate::error::{Error, Result};
use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Refuses a directory with artefacts of runs that are not in the grid. Other files, hidden ones and logs are nobody's business.
///
/// # Errors
/// [`Error::Input`] names the first; [`Error::Io`] when a directory cannot be read.
pub fn check(dir: &Path, grid: &Grid) -> Result<()> {
    let ours: HashSet<&Path> = grid.steps.iter().flat_map(|step| &step.outputs).map(|output| output.path.as_path()).collect();
    let mut found = Vec::new();
    if dir.exists() {
        walk(dir, &ours, &mut found).map_err(|e| Error::io(dir, "read", e))?;
    }
    found.sort();
    let Some(first) = found.first() else { return Ok(()) };
    let more = if found.len() > 1 { format!(" (and {} more such artefacts)", found.len() - 1) } else { String::new() };
    let message = format!(
        "belongs to no run of the experiment as it is now{more}: seeds, names or the order of shared settings were changed after it had begun; take the \
         change back, give the experiment another name (a copy of its file) or another directory (--dir), or move away what you no longer want"
    );
    Err(Error::input(first, message))
}

fn walk(dir: &Path, ours: &HashSet<&Path>, found: &mut Vec<PathBuf>) -> std::io::Result<()> {
    for entry in fs::read_dir(dir)? {
        let entry = entry?;
        let (path, name) = (entry.path(), entry.file_name());
        let name = name.to_string_lossy();
        if name.starts_with('.') || ours.contains(path.as_path()) {
            continue;
        }
        if Stage::ALL.iter().any(|stage| artefact_of(*stage).0 == name) {
            found.push(path);
        } else if entry.file_type()?.is_dir() {
            walk(&path, ours, found)?;
        }
    }
    Ok(())
}
