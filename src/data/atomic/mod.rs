//! Files and directories that appear whole or not at all: built beside their place, renamed last. When anything fails (a full
//! disk, an interruption), nothing half-written stays and the old artefact is untouched. Links stay links, permissions stay as they were,
//! and what is no regular file (a device, a pipe) is written into.

mod directory;
mod disk;
mod pieces;
mod target;
mod temporary;

pub use directory::write_dir;
pub use pieces::{Workplace, link, write_piece};
pub use target::{Target, follow, target};
pub(super) use temporary::is_temporary;

use crate::error::{Error, Result};
use crate::interrupt;
use disk::{parent_of, sync_directory};
use rustix::fs::OFlags;
use rustix::io::Errno;
use std::fs::{self, File};
use std::io::{Read, Seek, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt, chown};
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::{Duration, Instant};
use tempfile::NamedTempFile;

/// Writes a file of these bytes, creating the directories above it.
///
/// # Errors
/// As [`write_all`].
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    write_all(&[(path.to_path_buf(), bytes.to_vec())])
}

/// Writes files that belong together: none takes its place before all are on the disk. The last is the one that other stages wait for.
///
/// # Errors
/// [`Error::Io`] naming the file at fault; [`Error::Input`] when something stands in a file's place that no file can replace.
pub fn write_all(files: &[(PathBuf, Vec<u8>)]) -> Result<()> {
    let targets = files.iter().map(|(path, _)| target(path)).collect::<Result<Vec<_>>>()?;
    let mut written = Vec::new();
    for ((path, bytes), target) in files.iter().zip(&targets) {
        if let Target::File(place) = target {
            let mut file = beside(path, place)?;
            finish(path, &mut file, bytes)?;
            written.push((path, place, file));
        }
    }
    for ((path, bytes), target) in files.iter().zip(&targets) {
        if let Target::Stream(place) = target {
            write_into(place, &mut &bytes[..]).map_err(|e| Error::io(path, "write", e))?;
        }
    }
    for (path, place, file) in written {
        file.persist(place).map_err(|e| Error::io(path, "rename", e.error))?;
        sync_directory(parent_of(place)?);
    }
    Ok(())
}

/// Writes a file that need not fit into memory: `fill` writes into an empty one, which takes the place of `path` when it has succeeded.
///
/// # Errors
/// As [`write_all`]; what `fill` returns.
pub fn write_with(path: &Path, fill: impl FnOnce(&mut File) -> Result<()>) -> Result<()> {
    let unwritten = |e| Error::io(path, "write", e);
    match target(path)? {
        Target::File(place) => {
            let mut file = beside(path, &place)?;
            fill(file.as_file_mut())?;
            finish(path, &mut file, &[])?;
            file.persist(&place).map_err(|e| Error::io(path, "rename", e.error))?;
            sync_directory(parent_of(&place)?);
        }
        Target::Stream(place) => {
            let mut file = tempfile::tempfile().map_err(unwritten)?;
            fill(&mut file)?;
            file.rewind().and_then(|()| write_into(&place, &mut file)).map_err(unwritten)?;
        }
    }
    Ok(())
}

/// Writes a file into a directory that is being filled: it has no other to replace, and nobody sees it before all are there.
///
/// # Errors
/// [`Error::Io`] when the system refuses.
pub fn write_new(path: &Path, bytes: &[u8]) -> Result<()> {
    parent_of(path)?;
    let mut file = File::create_new(path).map_err(|e| Error::io(path, "create", e))?;
    file.write_all(bytes).and_then(|()| file.sync_all()).map_err(|e| Error::io(path, "write", e))
}

/// A temporary file beside `place`, with the owner and the permissions of the file that stands there.
fn beside(path: &Path, place: &Path) -> Result<NamedTempFile> {
    let parent = parent_of(place)?;
    temporary::sweep(parent);
    let file = temporary::file(parent, path)?;
    if let Ok(old) = fs::metadata(place) {
        // Only root may give files away; where it does not, the new one is the user's own.
        let _ = chown(file.path(), Some(old.uid()), Some(old.gid()));
        file.as_file().set_permissions(old.permissions()).map_err(|e| Error::io(path, "create", e))?;
    }
    Ok(file)
}

/// The last bytes of a temporary file; then it is on the disk.
fn finish(path: &Path, file: &mut NamedTempFile, bytes: &[u8]) -> Result<()> {
    file.write_all(bytes).and_then(|()| file.as_file().sync_all()).map_err(|e| Error::io(path, "write", e))
}

/// How long a pipe may have no reader.
const READER_PATIENCE: Duration = Duration::from_secs(5);
/// How often is looked whether it has one.
const READER_TICK: Duration = Duration::from_millis(20);

/// Into a device or a pipe.
fn write_into(place: &Path, from: &mut impl Read) -> std::io::Result<()> {
    let waits = interrupt::waiting();
    let began = Instant::now();
    // Opened without waiting, to learn whether a pipe has a reader; a write waits for the reader as usual.
    let open = |flags: OFlags| File::options().write(true).custom_flags(flags.bits().cast_signed()).open(place);
    let probe = loop {
        match open(OFlags::NONBLOCK) {
            Err(e) if e.raw_os_error() == Some(Errno::NXIO.raw_os_error()) && began.elapsed() < READER_PATIENCE => {
                sleep(READER_TICK)
            }
            Err(e) if e.raw_os_error() == Some(Errno::NXIO.raw_os_error()) => {
                return Err(std::io::Error::other("nobody reads this pipe"));
            }
            other => break other?,
        }
    };
    let mut stream = open(OFlags::empty())?;
    drop((probe, waits));
    std::io::copy(from, &mut stream).map(drop)
}

/// Whether a file could be written to `path`, asked before the work that makes it; nothing is created.
///
/// # Errors
/// [`Error::Input`] when something stands there that no file can replace, [`Error::Io`] when the nearest directory that exists takes no file.
pub fn check_place(path: &Path) -> Result<()> {
    match target(path)? {
        Target::File(place) => check_above(path, &place),
        Target::Stream(_) => Ok(()),
    }
}

/// Whether a directory could be written to `path`, asked before the work that fills it; nothing is created.
///
/// # Errors
/// As [`write_dir`] has for a place that cannot be taken.
pub fn check_directory(path: &Path, ours: impl Fn(&Path) -> bool) -> Result<()> {
    let place = directory::check_directory(path, ours)?;
    check_above(path, &place.probe())
}

/// Whether something can be created in the nearest directory above `place` that exists.
fn check_above(path: &Path, place: &Path) -> Result<()> {
    let nearest = place.ancestors().skip(1).find(|p| p.exists()).unwrap_or(Path::new("/"));
    temporary::sweep(nearest);
    temporary::file(nearest, path).map(drop)
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
        let ours = |name: &Path| name == Path::new("a");
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
