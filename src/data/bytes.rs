//! How files come in: a file is looked at before it is read. Its first bytes say whether it is of the format at all, its last
//! ones whether it is whole, its length whether it can be one of ours; only then all of it is read.

use crate::error::{Error, Result};
use crate::interrupt;
use std::borrow::Cow;
use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::os::unix::fs::FileExt;
use std::path::Path;

/// Bytes of a file that its format is known by.
pub(super) const HEAD_BYTES: usize = 4096;
/// What stands in place of a file that Git LFS has not fetched.
const LFS_POINTER: &[u8] = b"version https://git-lfs";

/// A format, as far as the outside of a file shows it.
pub(super) struct Format {
    /// A longer file is refused.
    pub(super) most_bytes: u64,
    /// Why no file of hilt is longer.
    pub(super) reason: &'static str,
    /// What must hold of the first bytes, at most [`HEAD_BYTES`] of them.
    pub(super) head: fn(&Path, &[u8]) -> Result<()>,
    /// What must hold of beginning and end together.
    pub(super) ends: fn(&Path, &Ends) -> Result<()>,
}

impl Format {
    /// All bytes of a file that looks like one of the format. What is no regular file (a pipe) is read as far as is allowed.
    ///
    /// # Errors
    /// [`Error::Input`] when the file is empty, foreign, cut short, too long or a pointer of Git LFS; [`Error::Io`] when it cannot
    /// be read.
    pub(super) fn read(&self, path: &Path) -> Result<Vec<u8>> {
        let _waits = interrupt::waiting();
        let unreadable = |e| Error::io(path, "read", e);
        let mut file = File::open(path).map_err(unreadable)?;
        let kind = file.metadata().map_err(unreadable)?;
        let mut bytes = Vec::new();
        if kind.is_file() {
            let ends = Ends::OfFile(&file, kind.len());
            self.check_ends(path, &ends)?;
            let room = bytes.try_reserve_exact(kind.len() as usize);
            room.map_err(|_| Error::input(path, format!("has {} bytes, more than the memory takes", kind.len())))?;
        } else {
            (&mut file).take(HEAD_BYTES as u64).read_to_end(&mut bytes).map_err(unreadable)?;
            self.check_head(path, &bytes)?;
        }
        // One byte more than allowed tells that there are more.
        let rest = self.most_bytes + 1 - bytes.len() as u64;
        file.take(rest).read_to_end(&mut bytes).map_err(unreadable)?;
        Ok(bytes)
    }

    /// A file that looks like one of the format, to be read in parts, and its length. What is no regular file (a pipe) is copied to the disk.
    ///
    /// # Errors
    /// As [`Format::read`].
    pub(super) fn open(&self, path: &Path) -> Result<(File, u64)> {
        let _waits = interrupt::waiting();
        let unreadable = |e| Error::io(path, "read", e);
        let mut file = File::open(path).map_err(unreadable)?;
        if !file.metadata().map_err(unreadable)?.is_file() {
            let mut head = Vec::new();
            (&mut file).take(HEAD_BYTES as u64).read_to_end(&mut head).map_err(unreadable)?;
            self.check_head(path, &head)?;
            let mut copy = tempfile::tempfile().map_err(unreadable)?;
            let copied = copy.write_all(&head).and_then(|()| std::io::copy(&mut file.take(self.most_bytes), &mut copy));
            copied.map_err(unreadable)?;
            file = copy;
        }
        let len = file.metadata().map_err(unreadable)?.len();
        self.check_ends(path, &Ends::OfFile(&file, len))?;
        Ok((file, len))
    }

    /// The same checks of bytes that have been read.
    ///
    /// # Errors
    /// As [`Format::read`].
    pub(super) fn check(&self, path: &Path, bytes: &[u8]) -> Result<()> {
        self.check_ends(path, &Ends::OfBytes(bytes))
    }

    fn check_ends(&self, path: &Path, ends: &Ends) -> Result<()> {
        self.check_head(path, &ends.at(path, 0, HEAD_BYTES)?)?;
        if ends.len() > self.most_bytes {
            let (len, most, reason) = (ends.len(), self.most_bytes, self.reason);
            return Err(Error::input(path, format!("has {len} bytes, hilt reads at most {most}: {reason}")));
        }
        (self.ends)(path, ends)
    }

    fn check_head(&self, path: &Path, head: &[u8]) -> Result<()> {
        refuse_placeholder(path, head)?;
        (self.head)(path, head)
    }
}

/// Refuses what stands where a file ought to be.
///
/// # Errors
/// [`Error::Input`] for an empty file and for a pointer of Git LFS.
pub(super) fn refuse_placeholder(path: &Path, head: &[u8]) -> Result<()> {
    if head.is_empty() {
        return Err(Error::input(path, "is empty; run the stage that makes it again"));
    }
    if head.starts_with(LFS_POINTER) {
        return Err(Error::input(path, "is a pointer of Git LFS, not the file itself; fetch it with git lfs pull"));
    }
    Ok(())
}

/// The first bytes of a file, at most [`HEAD_BYTES`].
///
/// # Errors
/// [`Error::Io`] when it cannot be read.
pub(super) fn head(path: &Path) -> Result<Vec<u8>> {
    let mut head = Vec::new();
    let _waits = interrupt::waiting();
    let file = File::open(path).map_err(|e| Error::io(path, "read", e))?;
    file.take(HEAD_BYTES as u64).read_to_end(&mut head).map_err(|e| Error::io(path, "read", e))?;
    Ok(head)
}

/// A file, or its bytes, of which parts are looked at.
pub(super) enum Ends<'a> {
    /// On the disk, with its length.
    OfFile(&'a File, u64),
    /// In memory.
    OfBytes(&'a [u8]),
}

impl Ends<'_> {
    /// Number of bytes.
    pub(super) fn len(&self) -> u64 {
        match self {
            Ends::OfFile(_, len) => *len,
            Ends::OfBytes(bytes) => bytes.len() as u64,
        }
    }

    /// At most `len` bytes from `from` on.
    ///
    /// # Errors
    /// [`Error::Io`] when they cannot be read.
    pub(super) fn at(&self, path: &Path, from: u64, len: usize) -> Result<Cow<'_, [u8]>> {
        let end = self.len().min(from.saturating_add(len as u64));
        let from = from.min(end);
        match self {
            Ends::OfBytes(bytes) => Ok(Cow::Borrowed(&bytes[from as usize..end as usize])),
            Ends::OfFile(file, _) => {
                let mut part = vec![0; (end - from) as usize];
                match file.read_exact_at(&mut part, from) {
                    Ok(()) => Ok(Cow::Owned(part)),
                    Err(e) if e.kind() == ErrorKind::UnexpectedEof => Err(Error::input(path, "was cut short while it was read")),
                    Err(e) => Err(Error::io(path, "read", e)),
                }
            }
        }
    }

    /// At most the last `len` bytes.
    ///
    /// # Errors
    /// As [`Ends::at`].
    pub(super) fn tail(&self, path: &Path, len: usize) -> Result<Cow<'_, [u8]>> {
        self.at(path, self.len().saturating_sub(len as u64), len)
    }
}
