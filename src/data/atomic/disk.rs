//! Directories on the disk.

use crate::error::{Error, Result};
use std::fs::{self, File};
use std::path::Path;

/// The existing directory above `path`.
pub fn parent_of(path: &Path) -> Result<&Path> {
    let parent = match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    fs::create_dir_all(parent).map_err(|e| Error::io(parent, "create", e))?;
    Ok(parent)
}

/// Makes renames within a directory last. Some file systems cannot; their renames last as long as they do.
pub fn sync_directory(dir: &Path) {
    let _ = File::open(dir).and_then(|handle| handle.sync_all());
}
