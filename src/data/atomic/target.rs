//! What stands where something is to be written: links are followed, so that they stay links, and what is no regular file is known.

use crate::error::{Error, Result};
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::FileTypeExt;
use std::path::{Path, PathBuf};

/// Links in a row before they count as a circle, as on Linux.
const MAX_LINKS: usize = 40;
/// Open files of a process as the system shows them (`/dev/stdout` leads there): to be written into, never replaced.
const OPEN_FILES: &str = "/proc";

/// Where a file goes.
#[derive(Clone, Debug, PartialEq)]
pub enum Target {
    /// A regular file, or a place for one; no link.
    File(PathBuf),
    /// A device, a pipe or an open file, to be written into.
    Stream(PathBuf),
}

/// What a file written to `path` becomes; nothing is created.
///
/// # Errors
/// [`Error::Input`] when a directory, a socket or a disk stands there, when the name is one of a directory, or when links go in a circle.
pub fn target(path: &Path) -> Result<Target> {
    if path.as_os_str().as_bytes().ends_with(b"/") || path.file_name().is_none() {
        return Err(Error::input(path, "names a directory, a file is to be written there; give a file's name"));
    }
    let place = follow(path)?;
    if place.starts_with(OPEN_FILES) {
        return Ok(Target::Stream(place));
    }
    let kind = match fs::symlink_metadata(&place) {
        Ok(found) => found.file_type(),
        Err(_) => return Ok(Target::File(place)),
    };
    if kind.is_dir() {
        return Err(Error::input(path, "is a directory, a file is to be written there; choose another name"));
    }
    if kind.is_fifo() || kind.is_char_device() {
        return Ok(Target::Stream(place));
    }
    if !kind.is_file() {
        return Err(Error::input(
            path,
            "is a socket or a disk, hilt writes to files, pipes and character devices; choose another name",
        ));
    }
    Ok(Target::File(place))
}

/// The place that a chain of links leads to, with its directory in the system's own words where that exists.
///
/// # Errors
/// [`Error::Input`] when the links go in a circle.
pub fn follow(path: &Path) -> Result<PathBuf> {
    let mut place = absolute(path);
    for _ in 0..MAX_LINKS {
        if place.starts_with(OPEN_FILES) {
            return Ok(place);
        }
        match fs::read_link(&place) {
            Ok(link) => place = absolute(&place.parent().unwrap_or(Path::new("/")).join(link)),
            Err(_) => return Ok(place),
        }
    }
    Err(Error::input(path, "is a link that goes in a circle; choose another name"))
}

/// The path from the root, with its directory resolved; the last name stays as it is. Of directories that do not exist, the nearest that does is resolved.
fn absolute(path: &Path) -> PathBuf {
    let (mut names, mut at) = (Vec::new(), path.to_path_buf());
    while let (Some(above), Some(name)) = (at.parent(), at.file_name()) {
        names.push(name.to_os_string());
        let above = if above.as_os_str().is_empty() { Path::new(".") } else { above };
        if let Ok(found) = fs::canonicalize(above) {
            return names.iter().rev().fold(found, |path, name| path.join(name));
        }
        at = above.to_path_buf();
    }
    // A path that ends with "..", or the root: it names a directory.
    fs::canonicalize(path).or_else(|_| std::path::absolute(path)).unwrap_or_else(|_| path.to_path_buf())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    #[test]
    fn links_are_followed_and_streams_are_known() {
        let dir = tempfile::tempdir().expect("temporary directory");
        let root = fs::canonicalize(dir.path()).expect("there");
        let at = |name: &str| root.join(name);
        fs::write(at("file"), "").expect("written");
        symlink("file", at("link")).expect("linked");
        symlink("new", at("dangling")).expect("linked");
        symlink("two", at("one")).expect("linked");
        symlink("one", at("two")).expect("linked");
        symlink("/proc/self/fd/1", at("stdout")).expect("linked");
        assert_eq!(target(&at("link")).expect("a file"), Target::File(at("file")));
        assert_eq!(target(&at("dangling")).expect("a place"), Target::File(at("new")));
        assert_eq!(target(&at("in/none/yet")).expect("a place"), Target::File(at("in/none/yet")));
        assert!(target(&at("one")).unwrap_err().to_string().contains("circle"));
        for stream in [Path::new("/dev/null"), Path::new("/dev/stdout"), &at("stdout")] {
            assert!(matches!(target(stream), Ok(Target::Stream(_))), "{}", stream.display());
        }
        for directory in [root.as_path(), Path::new("."), &at("new/"), Path::new("..")] {
            assert!(target(directory).unwrap_err().to_string().contains("directory"), "{}", directory.display());
        }
    }
}
