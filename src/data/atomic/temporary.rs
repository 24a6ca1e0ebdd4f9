//! What is not whole yet: names, and who removes it when its process was killed.
//!
//! A process holds a lock (`flock`) on each of its temporary files and directories, and the system lets go of it when the process ends,
//! however it ends. So the next process that writes beside one finds it unlocked, and removes it. Between a file's creation and its
//! lock its directory is locked, shared by those who create and alone by those who remove. On a file system without such locks nothing is removed.

use crate::error::{Error, Result};
use std::fs::{self, File, Permissions, TryLockError};
use std::io;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::thread::sleep;
use std::time::Duration;
use tempfile::{NamedTempFile, TempDir};

/// Temporary names are this, some letters, and [`SUFFIX`].
const PREFIX: &str = ".hilt-";
const SUFFIX: &str = ".new";
/// Letters and digits between the two.
const LETTERS: usize = 6;
/// How often a directory's lock is asked for, and the time in between: removing what is left takes a moment.
const TRIES: usize = 20;
const PAUSE: Duration = Duration::from_millis(1);
/// Mode of files before the umask (0644 under the usual one), instead of a temporary file's 0600.
const FILE_MODE: u32 = 0o666;
/// Mode of directories before the umask.
const DIRECTORY_MODE: u32 = 0o777;

/// Whether a name is one of a temporary file or directory of hilt.
pub fn is_temporary(name: &str) -> bool {
    let letters = name.strip_prefix(PREFIX).and_then(|n| n.strip_suffix(SUFFIX));
    letters.is_some_and(|l| l.len() == LETTERS && l.bytes().all(|b| b.is_ascii_alphanumeric()))
}

/// A new file in `dir`, locked; an error speaks of `path`, which it is for.
pub(super) fn file(dir: &Path, path: &Path) -> Result<NamedTempFile> {
    let _creating = lock_shared(dir);
    let made = builder(FILE_MODE).tempfile_in(dir).map_err(|e| Error::io(path, "create", unnamed(&e)))?;
    // Without locks nobody removes anything.
    let _ = made.as_file().try_lock();
    Ok(made)
}

/// An error without the temporary name that it speaks of, which nobody has given.
fn unnamed(error: &io::Error) -> io::Error {
    let words = error.to_string();
    io::Error::new(error.kind(), words.split(" at path \"").next().unwrap_or_default())
}

/// A directory under a temporary name, locked as long as this value lives.
pub(super) struct Directory {
    pub(super) dir: TempDir,
    _lock: Option<File>,
}

/// A new directory in `parent`; an error speaks of `path`, which it is for.
pub(super) fn directory(parent: &Path, path: &Path) -> Result<Directory> {
    let _creating = lock_shared(parent);
    let dir = builder(DIRECTORY_MODE).tempdir_in(parent).map_err(|e| Error::io(path, "create", unnamed(&e)))?;
    let lock = File::open(dir.path()).ok().filter(|handle| handle.try_lock().is_ok());
    Ok(Directory { dir, _lock: lock })
}

/// Removes what killed processes left in `dir`. What cannot be removed stays; it harms nobody.
pub(super) fn sweep(dir: &Path) {
    let Ok(entries) = fs::read_dir(dir) else { return };
    let found: Vec<_> = entries.flatten().filter(|e| e.file_name().to_str().is_some_and(is_temporary)).collect();
    if found.is_empty() {
        return;
    }
    let Some(_alone) = File::open(dir).ok().filter(|handle| handle.try_lock().is_ok()) else { return };
    for entry in found {
        let (path, kind) = (entry.path(), entry.file_type());
        let left = |handle: &File| handle.try_lock().is_ok();
        match kind {
            Ok(kind) if kind.is_dir() && File::open(&path).is_ok_and(|h| left(&h)) => drop(fs::remove_dir_all(&path)),
            Ok(kind) if kind.is_file() && File::open(&path).is_ok_and(|h| left(&h)) => drop(fs::remove_file(&path)),
            _ => {}
        }
    }
}

/// The lock of a directory in which something is created. It is not waited for long: a directory that is being filled is locked by
/// the process that fills it, and nobody removes anything in there.
fn lock_shared(dir: &Path) -> Option<File> {
    let handle = File::open(dir).ok()?;
    for _ in 0..TRIES {
        match handle.try_lock_shared() {
            Ok(()) => return Some(handle),
            Err(TryLockError::WouldBlock) => sleep(PAUSE),
            Err(TryLockError::Error(_)) => return None,
        }
    }
    None
}

fn builder(mode: u32) -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX).rand_bytes(LETTERS).permissions(Permissions::from_mode(mode));
    builder
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_killed_process_left_is_removed_and_what_is_in_use_stays() {
        let dir = tempfile::tempdir().expect("temporary directory");
        let at = |name: &str| dir.path().join(name);
        fs::write(at(".hilt-abc123.new"), "left").expect("written");
        fs::create_dir_all(at(".hilt-dir456.new/old")).expect("made");
        fs::write(at(".hilt-notes"), "a user's own").expect("written");
        let (used, filled) = (file(dir.path(), &at("a")).expect("made"), directory(dir.path(), &at("b")).expect("made"));
        sweep(dir.path());
        assert!(used.path().is_file() && filled.dir.path().is_dir(), "removed while in use");
        assert!(!at(".hilt-abc123.new").exists() && !at(".hilt-dir456.new").exists(), "not removed");
        assert!(at(".hilt-notes").exists(), "not ours");
    }
}
