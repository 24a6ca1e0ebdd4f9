//! Files and directories that appear whole or not at all: built beside their place, renamed last. When anything fails (a full
//! disk, an interruption), nothing half-written stays and the old artefact is untouched.

use crate::error::{Error, Result};
use std::fs::{self, Permissions};
use std::io::Write;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Name of what is not whole yet.
const PREFIX: &str = ".hilt-";
/// Mode of files before the umask (0644 under the usual one), instead of a temporary file's 0600.
const FILE_MODE: u32 = 0o666;
/// Mode of directories before the umask.
const DIRECTORY_MODE: u32 = 0o777;

/// Writes a file of these bytes, creating the directories above it.
///
/// # Errors
/// [`Error::Io`] naming `path` when the system refuses to create, write, sync or rename.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    write_all(&[(path.to_path_buf(), bytes.to_vec())])
}

/// Writes files that belong together: none takes its place before all are on the disk. The last is the one that other stages wait for.
///
/// # Errors
/// [`Error::Io`] naming the file at fault; [`Error::Input`] when a directory stands in a file's place.
pub fn write_all(files: &[(PathBuf, Vec<u8>)]) -> Result<()> {
    files.iter().try_for_each(|(path, _)| refuse_directory(path))?;
    let written = files.iter().map(|(path, bytes)| Ok((path, beside(path, bytes)?))).collect::<Result<Vec<_>>>()?;
    for (path, file) in written {
        file.persist(path).map_err(|e| Error::io(path, "rename", e.error))?;
    }
    Ok(())
}

/// The bytes in a temporary file beside `path`.
fn beside(path: &Path, bytes: &[u8]) -> Result<NamedTempFile> {
    let mut file = builder(FILE_MODE).tempfile_in(parent_of(path)?).map_err(|e| Error::io(path, "create", e))?;
    file.write_all(bytes).and_then(|()| file.as_file().sync_all()).map_err(|e| Error::io(path, "write", e))?;
    Ok(file)
}

/// Whether a file could be written to `path`, asked before the work that makes it; nothing is created.
///
/// # Errors
/// [`Error::Input`] when a directory stands there, [`Error::Io`] when the nearest directory that exists takes no file.
pub fn check_place(path: &Path) -> Result<()> {
    refuse_directory(path)?;
    let above = path.ancestors().skip(1).map(|p| if p.as_os_str().is_empty() { Path::new(".") } else { p });
    let nearest = above.into_iter().find(|p| p.exists()).unwrap_or(Path::new("."));
    builder(FILE_MODE).tempfile_in(nearest).map(drop).map_err(|e| Error::io(path, "create", e))
}

fn refuse_directory(path: &Path) -> Result<()> {
    if path.is_dir() {
        return Err(Error::input(path, "is a directory, a file is to be written there; choose another name"));
    }
    Ok(())
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
    fn files_that_belong_together_appear_together_or_not_at_all() {
        let dir = tempfile::tempdir().expect("temporary directory");
        let path = dir.path().join("a.txt");
        write_bytes(&path, b"old").expect("written");
        // The second of two files has no place: the first must not take its own.
        let pair = [(path.clone(), b"new".to_vec()), (path.join("b.txt"), b"new".to_vec())];
        assert!(matches!(write_all(&pair), Err(Error::Io { .. })));
        assert_eq!(fs::read(&path).expect("still there"), b"old");
        assert_eq!(names(dir.path()), ["a.txt"]);
    }

    #[test]
    fn a_place_is_checked_without_a_trace() {
        let dir = tempfile::tempdir().expect("temporary directory");
        check_place(&dir.path().join("new/er/file")).expect("can be made");
        assert!(check_place(dir.path()).unwrap_err().to_string().contains("is a directory"));
        write_bytes(&dir.path().join("file"), b"").expect("written");
        assert!(matches!(check_place(&dir.path().join("file/inner")), Err(Error::Io { .. })));
        assert_eq!(names(dir.path()), ["file"]);
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
