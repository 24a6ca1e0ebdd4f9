//! Very many files of a directory that grows, each of which appears whole.

use super::{directory, finish, temporary};
use crate::error::{Error, Result};
use std::fs::{self, File, TryLockError};
use std::io::ErrorKind;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::Duration;

/// How often a directory is made again that another process removes, and the time in between.
const TRIES: usize = 20;
const PAUSE: Duration = Duration::from_millis(1);

/// Writes one file of very many into a directory that is there: as [`super::write_bytes`], but the directory is looked at neither before nor after.
///
/// # Errors
/// [`Error::Io`] when the system refuses.
pub fn write_piece(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut file = temporary::file(path.parent().unwrap_or(Path::new(".")), path)?;
    finish(path, &mut file, bytes)?;
    file.persist(path).map(drop).map_err(|e| Error::io(path, "rename", e.error))
}

/// Gives a file a second name, or copies it where the file system has no such names or another begins.
///
/// # Errors
/// [`Error::Io`] when the system refuses.
pub fn link(from: &Path, to: &Path) -> Result<()> {
    fs::hard_link(from, to).or_else(|_| fs::copy(from, to).map(drop)).map_err(|e| Error::io(from, "read", e))
}

/// A directory in which this process works, perhaps beside others, as long as the value lives. It is told by a lock (`flock`), shared by those who work there
/// and held alone by the one who removes it; on a file system without such locks nobody waits for anybody.
#[derive(Debug)]
pub struct Workplace {
    path: PathBuf,
    lock: Option<File>,
}

impl Workplace {
    /// Makes the directory, with those above it, where it is not there; what killed processes left of files is removed.
    ///
    /// # Errors
    /// [`Error::Io`] when the system refuses.
    pub fn enter(path: &Path) -> Result<Self> {
        let io = |e| Error::io(path, "create", e);
        for _ in 0..TRIES {
            fs::create_dir_all(path).map_err(io)?;
            temporary::sweep(path);
            let handle = match File::open(path) {
                Err(gone) if gone.kind() == ErrorKind::NotFound => continue,
                opened => opened.map_err(|e| Error::io(path, "open", e))?,
            };
            let number = |found: std::io::Result<fs::Metadata>| found.ok().map(|found| found.ino());
            let is_there = || number(handle.metadata()) == number(fs::metadata(path));
            match handle.try_lock_shared() {
                Ok(()) if is_there() => return Ok(Workplace { path: path.to_path_buf(), lock: Some(handle) }),
                Err(TryLockError::Error(_)) => return Ok(Workplace { path: path.to_path_buf(), lock: None }),
                _ => sleep(PAUSE),
            }
        }
        Err(io(std::io::Error::other("another process removes it again and again")))
    }

    /// Removes the directory, with all in it or only if it is empty, unless another process works there; whether it is gone.
    ///
    /// # Errors
    /// [`Error::Io`] when the system refuses.
    pub fn remove(self, if_empty: bool) -> Result<bool> {
        drop(self.lock);
        let alone = File::open(&self.path);
        if let Ok(Err(TryLockError::WouldBlock)) = alone.as_ref().map(File::try_lock) {
            return Ok(false);
        }
        if if_empty { Ok(fs::remove_dir(&self.path).is_ok()) } else { directory::remove_dir(&self.path).map(|()| true) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_directory_stays_while_another_works_in_it() {
        let dir = tempfile::tempdir().expect("temporary directory");
        let path = dir.path().join("a/b");
        let enter = || Workplace::enter(&path).expect("made");
        let (one, two, three) = (enter(), enter(), enter());
        write_piece(&path.join("piece"), b"whole").expect("written");
        assert!(!one.remove(false).expect("asked"));
        assert!(!two.remove(true).expect("asked"));
        assert_eq!(fs::read(path.join("piece")).expect("there"), b"whole");
        assert!(!enter().remove(true).expect("asked"), "it is not empty, and another works there");
        assert!(three.remove(false).expect("asked") && !path.exists());
        assert!(enter().remove(true).expect("asked") && !path.exists());
        assert_eq!(fs::read_dir(dir.path().join("a")).expect("there").count(), 0, "left over");
    }
}
