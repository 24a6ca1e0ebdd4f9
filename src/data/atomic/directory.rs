//! Directories that take their place whole: filled beside it, exchanged in one step.

use super::disk::{parent_of, sync_directory};
use super::target::follow;
use super::temporary::{self, Directory};
use crate::data::litter::{FileKind, kind_of_name};
use crate::error::{Error, Result};
use rustix::fs::{AtFlags, CWD, RenameFlags, StatxAttributes, StatxFlags, renameat_with, statx};
use rustix::io::Errno;
use std::fs;
use std::io::ErrorKind;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// Writes a directory: `fill` gets an empty one, which takes the place of `path` when `fill` has succeeded. A directory that stands there
/// already is replaced only if `ours` knows every file in it, by its path below `path`; what file browsers leave does not count, and other hidden files
/// at its top are kept. The working directory and mount points cannot be exchanged: they are filled where they are, if they are empty.
///
/// # Errors
/// As [`super::check_directory`]; what `fill` returns; [`Error::Io`] when the system refuses.
pub fn write_dir(path: &Path, ours: impl Fn(&Path) -> bool, fill: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    let place = check_directory(path, ours)?;
    let parent = if place.in_place { place.path.as_path() } else { parent_of(&place.path)? };
    temporary::sweep(parent);
    let fresh = temporary::directory(parent, path)?;
    fill(fresh.dir.path()).map_err(|e| in_words_of(e, fresh.dir.path(), path))?;
    sync_all_below(fresh.dir.path()).map_err(|e| Error::io(path, "write", e))?;
    if place.in_place { move_in(fresh, &place.path) } else { exchange(fresh, &place) }.map_err(|e| match e.kind() {
        ErrorKind::DirectoryNotEmpty => {
            Error::input(path, "another process has put a directory there meanwhile, which stays; run the command again")
        }
        _ => Error::io(path, "rename", e),
    })?;
    sync_directory(parent);
    Ok(())
}

/// Removes a directory and all in it. It is gone in one step: no other process sees a part of it, and one that is killed leaves nothing of it.
///
/// # Errors
/// [`Error::Io`] when the system refuses.
pub(super) fn remove_dir(path: &Path) -> Result<()> {
    let aside = temporary::directory(parent_of(path)?, path)?;
    match fs::rename(path, aside.dir.path().join("old")) {
        Err(e) if e.kind() != ErrorKind::NotFound => Err(Error::io(path, "remove", e)),
        _ => aside.dir.close().map_err(|e| Error::io(path, "remove", e)),
    }
}

/// Where a directory goes.
#[derive(Debug)]
pub(super) struct Place {
    path: PathBuf,
    exists: bool,
    /// It must stay the directory that it is: it is filled, not exchanged.
    in_place: bool,
    /// Hidden files at its top that are somebody's own.
    kept: Vec<PathBuf>,
}

impl Place {
    /// A name beside which something can be created if this place can be written.
    pub(super) fn probe(&self) -> PathBuf {
        if self.in_place { self.path.join("inner") } else { self.path.clone() }
    }
}

/// Whether [`write_dir`] could write `path`, asked before the work; nothing is created.
///
/// # Errors
/// [`Error::Input`] when it holds something foreign, when a file stands there, or when it is the working directory or a mount point and not empty.
pub(super) fn check_directory(path: &Path, ours: impl Fn(&Path) -> bool) -> Result<Place> {
    let place = follow(path)?;
    let Ok(found) = fs::metadata(&place) else {
        return Ok(Place { path: place, exists: false, in_place: false, kept: Vec::new() });
    };
    if !found.is_dir() {
        return Err(Error::input(path, "is a file, a directory is to be written there; remove it or choose another place"));
    }
    let mut kept = Vec::new();
    let mut empty = true;
    for name in files_below(&place).map_err(|e| Error::io(path, "read", e))? {
        let kind = kind_of_name(&name);
        empty &= kind == FileKind::Litter;
        let at_top = name.components().count() == 1;
        match kind {
            FileKind::Litter => {}
            FileKind::Hidden if at_top => kept.push(name),
            _ if ours(&name) => {}
            _ => {
                let name = name.display();
                let message = format!("holds \"{name}\", which this stage does not write; empty it or choose another place");
                return Err(Error::input(path, message));
            }
        }
    }
    let fixed = fixed(&place);
    match fixed {
        Some(what) if !empty => Err(Error::input(
            path,
            format!(
                "is {what} and not empty, so its content cannot be exchanged in one step; empty it, or name a directory inside it"
            ),
        )),
        _ => Ok(Place { path: place, exists: true, in_place: fixed.is_some(), kept }),
    }
}

/// Why a directory cannot be exchanged for another.
fn fixed(place: &Path) -> Option<&'static str> {
    if std::env::current_dir().and_then(fs::canonicalize).is_ok_and(|here| here.starts_with(place)) {
        return Some("the working directory or above it");
    }
    is_mount(place).then_some("a mount point")
}

fn is_mount(place: &Path) -> bool {
    if let Ok(found) = statx(CWD, place, AtFlags::empty(), StatxFlags::BASIC_STATS)
        && found.stx_attributes_mask.contains(StatxAttributes::MOUNT_ROOT)
    {
        return found.stx_attributes.contains(StatxAttributes::MOUNT_ROOT);
    }
    let device = |path: &Path| fs::metadata(path).map(|found| found.dev()).ok();
    place.parent().is_none_or(|parent| device(parent) != device(place))
}

/// The fresh directory takes the place, in one step also where another stands.
fn exchange(fresh: Directory, place: &Place) -> std::io::Result<()> {
    let new = fresh.dir.path();
    if !place.exists {
        fs::rename(new, &place.path)?;
        // It is no temporary directory any more.
        let _renamed = fresh.dir.keep();
        return Ok(());
    }
    fs::set_permissions(new, fs::metadata(&place.path)?.permissions())?;
    for name in &place.kept {
        let (from, to) = (place.path.join(name), new.join(name));
        fs::hard_link(&from, &to).or_else(|_| fs::copy(&from, &to).map(drop))?;
    }
    match renameat_with(CWD, new, CWD, &place.path, RenameFlags::EXCHANGE) {
        Ok(()) => Ok(()),
        Err(Errno::INVAL | Errno::NOSYS | Errno::NOTSUP) => exchange_in_two(fresh, &place.path),
        Err(e) => Err(e.into()),
    }
}

/// For file systems that cannot exchange: the old one is moved aside first. Killed in between, it is found beside its place as `.<name>.hilt-old`.
fn exchange_in_two(fresh: Directory, path: &Path) -> std::io::Result<()> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let old = path.with_file_name(format!(".{name}.hilt-old"));
    if old.exists() {
        fs::remove_dir_all(&old)?;
    }
    fs::rename(path, &old)?;
    if let Err(e) = fs::rename(fresh.dir.path(), path) {
        fs::rename(&old, path)?;
        return Err(e);
    }
    let _renamed = fresh.dir.keep();
    fs::remove_dir_all(&old)
}

/// Moves what was made into an empty directory that must stay; what was moved goes back out when something cannot be.
fn move_in(fresh: Directory, place: &Path) -> std::io::Result<()> {
    let mut moved = Vec::new();
    let mut entries = fs::read_dir(fresh.dir.path())?.collect::<std::io::Result<Vec<_>>>()?;
    entries.sort_by_key(fs::DirEntry::file_name);
    for entry in entries {
        let to = place.join(entry.file_name());
        if let Err(e) = fs::rename(entry.path(), &to) {
            moved.iter().for_each(|(from, to)| drop(fs::rename(to, from)));
            return Err(e);
        }
        moved.push((entry.path(), to));
    }
    Ok(())
}

fn sync_all_below(dir: &Path) -> std::io::Result<()> {
    for entry in fs::read_dir(dir)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            sync_all_below(&entry.path())?;
        }
    }
    sync_directory(dir);
    Ok(())
}

/// Paths below `root` of all that is no directory. Links are not followed.
fn files_below(root: &Path) -> std::io::Result<Vec<PathBuf>> {
    let (mut found, mut open) = (Vec::new(), vec![PathBuf::new()]);
    while let Some(inner) = open.pop() {
        for entry in fs::read_dir(root.join(&inner))? {
            let entry = entry?;
            let name = inner.join(entry.file_name());
            let temporary = entry.file_name().to_str().is_some_and(temporary::is_temporary);
            if entry.file_type()?.is_dir() && !temporary { open.push(name) } else { found.push(name) }
        }
    }
    found.sort();
    Ok(found)
}

/// The same error, speaking of the final place.
fn in_words_of(error: Error, from: &Path, to: &Path) -> Error {
    let moved = |path: &Path| path.strip_prefix(from).map_or_else(|_| path.to_path_buf(), |inner| to.join(inner));
    match error {
        Error::Input { path, message } => Error::Input { path: moved(&path), message },
        Error::Io { path, action, source } => Error::Io { path: moved(&path), action, source },
        other => other,
    }
}
