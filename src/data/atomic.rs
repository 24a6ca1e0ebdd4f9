//! Files and directories that appear whole or not at all: built beside their place, renamed last. When anything fails (a full
//! disk, an interruption), nothing half-written stays and the old artefact is untouched.

use crate::error::{Error, Result};
use std::fs::{self, Permissions};
use std::io::{self, BufWriter, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

/// Name of what is not whole yet.
const PREFIX: &str = ".hilt-";
/// Mode of files before the umask (0644 under the usual one), instead of a temporary file's 0600.
const FILE_MODE: u32 = 0o666;
/// Mode of directories before the umask.
const DIRECTORY_MODE: u32 = 0o777;

/// Writes a file with `fill`, creating the directories above it.
///
/// # Errors
/// [`Error::Io`] naming `path` when the system refuses to create, write, sync or rename.
pub fn write_file(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
    let parent = parent_of(path)?;
    let file = builder(FILE_MODE).tempfile_in(parent).map_err(|e| Error::io(path, "create", e))?;
    let mut out = BufWriter::new(file);
    let written = fill(&mut out).and_then(|()| out.flush()).and_then(|()| out.get_ref().as_file().sync_all());
    written.map_err(|e| Error::io(path, "write", e))?;
    let (file, _) = out.into_parts();
    file.persist(path).map(drop).map_err(|e| Error::io(path, "rename", e.error))
}

/// Writes a file of these bytes; see [`write_file`].
///
/// # Errors
/// As [`write_file`].
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    write_file(path, |out| out.write_all(bytes))
}

/// Writes a directory: `fill` gets an empty one beside `path`, which takes its place when `fill` has succeeded. A directory that
/// stands there already is replaced only if `ours` knows every name in it.
///
/// # Errors
/// What `fill` returns; [`Error::Input`] when `path` holds something foreign, [`Error::Io`] when the system refuses.
pub fn write_dir(path: &Path, ours: impl Fn(&str) -> bool, fill: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    let parent = parent_of(path)?;
    check_replaceable(path, ours)?;
    let create = || builder(DIRECTORY_MODE).tempdir_in(parent).map_err(|e| Error::io(path, "create", e));
    let fresh = create()?;
    fill(fresh.path()).map_err(|e| in_place(e, fresh.path(), path))?;
    if !path.exists() {
        return fs::rename(fresh.path(), path).map_err(|e| Error::io(path, "rename", e));
    }
    let aside = create()?;
    let old = aside.path().join("old");
    fs::rename(path, &old).map_err(|e| Error::io(path, "rename", e))?;
    fs::rename(fresh.path(), path).map_err(|e| match fs::rename(&old, path) {
        Ok(()) => Error::io(path, "rename", e),
        Err(worse) => {
            // The old artefact stays where it is: it must not be removed with its temporary parent.
            let _kept = aside.keep();
            Error::io(&old, "rename", worse)
        }
    })
}

fn builder(mode: u32) -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).permissions(Permissions::from_mode(mode));
    builder
}

/// The existing directory above `path`.
fn parent_of(path: &Path) -> Result<&Path> {
    let parent = match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    fs::create_dir_all(parent).map_err(|e| Error::io(parent, "create", e))?;
    Ok(parent)
}

fn check_replaceable(path: &Path, ours: impl Fn(&str) -> bool) -> Result<()> {
    if path.is_file() {
        return Err(Error::input(path, "is a file, a directory is to be written there; remove it or choose another place"));
    }
    let Ok(entries) = fs::read_dir(path) else { return Ok(()) };
    for entry in entries {
        let name = entry.map_err(|e| Error::io(path, "read", e))?.file_name();
        let name = name.to_string_lossy();
        if !ours(&name) {
            let message = format!("holds \"{name}\", which this stage does not write; empty it or choose another place");
            return Err(Error::input(path, message));
        }
    }
    Ok(())
}

/// The same error, speaking of the final place.
fn in_place(error: Error, from: &Path, to: &Path) -> Error {
    let moved = |path: &Path| path.strip_prefix(from).map_or_else(|_| path.to_path_buf(), |inner| to.join(inner));
    match error {
        Error::Input { path, message } => Error::Input { path: moved(&path), message },
        Error::Io { path, action, source } => Error::Io { path: moved(&path), action, source },
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(dir: &Path) -> Vec<String> {
        let entries = fs::read_dir(dir).expect("readable");
        entries.map(|e| e.expect("entry").file_name().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn a_writer_that_fails_keeps_the_old_file_and_leaves_nothing() {
        let dir = tempfile::tempdir().expect("temporary directory");
        let path = dir.path().join("a.txt");
        write_bytes(&path, b"old").expect("written");
        let failed = write_file(&path, |out| {
            out.write_all(b"half of it")?;
            Err(io::Error::from(io::ErrorKind::StorageFull))
        });
        assert!(matches!(failed, Err(Error::Io { action: "write", .. })));
        assert_eq!(fs::read(&path).expect("still there"), b"old");
        assert_eq!(names(dir.path()), ["a.txt"]);
    }

    #[test]
    fn a_directory_is_swapped_whole_and_foreign_content_is_refused() {
        let dir = tempfile::tempdir().expect("temporary directory");
        let path = dir.path().join("out");
        let ours = |name: &str| name == "a";
        write_dir(&path, ours, |d| write_bytes(&d.join("a"), b"1")).expect("first");
        let failed = write_dir(&path, ours, |d| {
            write_bytes(&d.join("a"), b"2")?;
            Err(Error::input(&d.join("a"), "no"))
        });
        assert!(failed.unwrap_err().to_string().contains("out/a: no"));
        assert_eq!(fs::read(path.join("a")).expect("old"), b"1");
        write_dir(&path, ours, |d| write_bytes(&d.join("a"), b"3")).expect("second");
        assert_eq!(fs::read(path.join("a")).expect("new"), b"3");
        fs::write(path.join("thesis.tex"), "years of work").expect("written");
        assert!(write_dir(&path, ours, |_| Ok(())).unwrap_err().to_string().contains("thesis.tex"));
        assert_eq!(names(dir.path()), ["out"]);
    }
}
