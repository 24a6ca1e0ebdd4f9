//! A seal: the BLAKE3 hash of a file, kept inside that file. It is computed over all bytes with the 64 digits of the hash itself
//! set to zero, so any changed bit is found before a decoder sees the file.

use super::content_hash::ContentHash;
use crate::error::{Error, Result};
use std::fs::File;
use std::io::{self, ErrorKind};
use std::ops::Range;
use std::os::unix::fs::FileExt;
use std::path::Path;

/// Version of the layout of all artefacts. It grows when a reader of the old layout would fail.
pub const SCHEMA_VERSION: u32 = 1;
/// What stands before the 64 hexadecimal digits.
const MARK: &str = "hilt-seal-blake3:";
/// Hexadecimal digits of a BLAKE3 hash.
const DIGITS: usize = 64;
/// Bytes of a long file that are hashed at once.
const PART_BYTES: usize = 1 << 20;
/// The field that versions of hilt agree on.
const VERSION_FIELD: &[u8] = b"schema_version";

/// The text to put into a file before [`close`]: the mark and 64 zeros.
pub fn blank() -> String {
    MARK.to_string() + &"0".repeat(DIGITS)
}

/// Fills in the last seal of `bytes`, blank or not.
///
/// # Panics
/// If `bytes` hold no seal: a writer that forgot it.
pub fn close(mut bytes: Vec<u8>) -> Vec<u8> {
    let at = digits_at(&bytes).expect("the writer put a blank seal into the file");
    bytes[at..at + DIGITS].fill(b'0');
    let hash = blake3::hash(&bytes).to_hex();
    bytes[at..at + DIGITS].copy_from_slice(hash.as_bytes());
    bytes
}

/// As [`close`], of the end of a file that holds the seal; what comes before it has gone into `before`. Returns the hash of the whole
/// file too.
///
/// # Panics
/// As [`close`].
pub(super) fn close_end(before: &blake3::Hasher, mut end: Vec<u8>) -> (Vec<u8>, blake3::Hash) {
    let at = digits_at(&end).expect("the writer put a blank seal into the end of the file");
    let hash = before.clone().update(&end).finalize().to_hex();
    end[at..at + DIGITS].copy_from_slice(hash.as_bytes());
    let whole = before.clone().update(&end).finalize();
    (end, whole)
}

/// As [`close`], of bytes that others made: `None` when they hold no seal. A seal is a checksum: whoever can write can make one, so
/// what stands behind it is not trusted.
pub fn reseal(bytes: Vec<u8>) -> Option<Vec<u8>> {
    digits_at(&bytes)?;
    Some(close(bytes))
}

/// Checks the seal of a file's bytes.
///
/// # Errors
/// [`Error::Input`] when there is none (another program wrote the file, or its end is missing), when the file was written by a
/// version of hilt with another schema, or when a byte differs.
pub fn check(path: &Path, bytes: &[u8]) -> Result<()> {
    check_but(path, bytes, 0..0)
}

/// As [`check`], of a file in which the seal took the bytes of `later`, behind it, for zeros: they were filled in after it.
///
/// # Errors
/// As [`check`].
pub(super) fn check_but(path: &Path, bytes: &[u8], later: Range<usize>) -> Result<()> {
    let at = digits_at(bytes).ok_or_else(|| missing(path))?;
    let digits = at..at + DIGITS;
    let mut hash = blake3::Hasher::new();
    hash.update(&bytes[..at]).update("0".repeat(DIGITS).as_bytes());
    match bytes.get(digits.end..later.start) {
        Some(between) => hash.update(between).update(&vec![0; later.len()]).update(&bytes[later.end..]),
        None => hash.update(&bytes[digits.end..]),
    };
    if bytes[digits] == *hash.finalize().to_hex().as_bytes() { Ok(()) } else { Err(broken(path, bytes)) }
}

fn missing(path: &Path) -> Error {
    let message = "no hilt seal found: the file is cut short or another program wrote it; run the stage that makes it again";
    Error::input(path, message)
}

/// The error for a file whose seal does not hold; `tail` is its end, or all of it.
fn broken(path: &Path, tail: &[u8]) -> Error {
    match foreign_version(tail) {
        Some(version) => wrong_version(path, version),
        None => Error::input(
            path,
            "damaged, or rewritten by another program: its content does not match its seal (a changed, missing or added byte); run \
             the stage that makes it again",
        ),
    }
}

/// As [`close`], of a file on the disk that need not fit into memory; its seal is blank and stands in its last `tail` bytes.
///
/// # Errors
/// What the system says.
pub(super) fn close_file(file: &File, tail: u64) -> io::Result<()> {
    let (from, tail) = tail_of(file, tail)?;
    let at = from + digits_at(&tail).ok_or(ErrorKind::InvalidData)? as u64;
    let (_, sealed) = hashes(file, at)?;
    file.write_all_at(sealed.to_hex().as_bytes(), at)
}

/// As [`check`], of a file on the disk whose seal stands in its last `tail` bytes; returns the hash of all its bytes.
///
/// # Errors
/// As [`check`]; [`Error::Io`] when it cannot be read.
pub(super) fn check_file(path: &Path, file: &File, tail: u64) -> Result<ContentHash> {
    let unreadable = |e| Error::io(path, "read", e);
    let (from, tail) = tail_of(file, tail).map_err(unreadable)?;
    let at = digits_at(&tail).ok_or_else(|| missing(path))?;
    let (content, sealed) = hashes(file, from + at as u64).map_err(unreadable)?;
    if tail[at..at + DIGITS] == *sealed.to_hex().as_bytes() { Ok(ContentHash(content)) } else { Err(broken(path, &tail)) }
}

/// The last `tail` bytes of a file, and where they begin.
fn tail_of(file: &File, tail: u64) -> io::Result<(u64, Vec<u8>)> {
    let len = file.metadata()?.len();
    let from = len.saturating_sub(tail);
    let mut bytes = vec![0; (len - from) as usize];
    file.read_exact_at(&mut bytes, from)?;
    Ok((from, bytes))
}

/// The hash of a file's bytes, and the one with zeros for the digits at `digits`.
fn hashes(file: &File, digits: u64) -> io::Result<(blake3::Hash, blake3::Hash)> {
    let (mut content, mut sealed) = (blake3::Hasher::new(), blake3::Hasher::new());
    let (mut part, mut at) = (vec![0; PART_BYTES], 0);
    loop {
        // A part ends where the digits begin, and where they end.
        let border = [digits, digits + DIGITS as u64].into_iter().find(|border| *border > at).unwrap_or(u64::MAX);
        let most = usize::try_from(border - at).map_or(PART_BYTES, |most| most.min(PART_BYTES));
        let read = match file.read_at(&mut part[..most], at) {
            Ok(0) => return Ok((content.finalize(), sealed.finalize())),
            Err(e) if e.kind() == ErrorKind::Interrupted => continue,
            read => read?,
        };
        content.update(&part[..read]);
        if (digits..digits + DIGITS as u64).contains(&at) {
            part[..read].fill(b'0');
        }
        sealed.update(&part[..read]);
        at += read as u64;
    }
}

/// The error for a file of another schema version.
pub(super) fn wrong_version(path: &Path, version: u64) -> Error {
    Error::input(
        path,
        format!("has schema version {version}, this hilt reads version {SCHEMA_VERSION}; run the stage that makes it again"),
    )
}

fn digits_at(bytes: &[u8]) -> Option<usize> {
    let at = find_last(bytes, MARK.as_bytes())? + MARK.len();
    (at + DIGITS <= bytes.len()).then_some(at)
}

/// Position of the last occurrence of `needle`.
pub(super) fn find_last(bytes: &[u8], needle: &[u8]) -> Option<usize> {
    let (first, last_start) = (needle.first()?, bytes.len().checked_sub(needle.len())?);
    (0..=last_start).rev().find(|&at| bytes[at] == *first && bytes[at..at + needle.len()] == *needle)
}

/// The number behind the last readable `schema_version`, if it is not ours.
fn foreign_version(bytes: &[u8]) -> Option<u64> {
    let at = find_last(bytes, VERSION_FIELD)? + VERSION_FIELD.len();
    let rest = &bytes[at..];
    let skipped = rest.iter().take_while(|b| b"\\\": ".contains(b)).count();
    let digits: String = rest[skipped..].iter().take_while(|b| b.is_ascii_digit()).map(|b| char::from(*b)).collect();
    digits.parse().ok().filter(|v| *v != u64::from(SCHEMA_VERSION))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_flipped_bit_and_every_cut_is_found() {
        let whole = close(format!("some bytes, {{\"schema_version\":1}} {} and a tail", blank()).into_bytes());
        let path = Path::new("file");
        check(path, &whole).expect("untouched");
        for at in 0..whole.len() {
            for bit in 0..8 {
                let mut bytes = whole.clone();
                bytes[at] ^= 1 << bit;
                assert!(check(path, &bytes).is_err(), "byte {at} bit {bit}");
            }
            assert!(check(path, &whole[..at]).is_err(), "cut at {at}");
        }
    }

    #[test]
    fn a_long_file_is_sealed_and_checked_as_its_bytes_are() {
        let text = |len: usize| format!("{}{}, and a tail", "ab".repeat(len), blank()).into_bytes();
        let (path, tail) = (Path::new("file"), 200);
        for len in [10, PART_BYTES / 2 - 40, PART_BYTES / 2, 2 * PART_BYTES + 7] {
            let file = tempfile::tempfile().expect("a file");
            file.write_all_at(&text(len), 0).expect("written");
            close_file(&file, tail).expect("sealed");
            let bytes = tail_of(&file, u64::MAX).expect("read").1;
            assert!(bytes == close(text(len)), "{len}");
            assert_eq!(check_file(path, &file, tail).expect("whole"), ContentHash::of(&bytes));
            for at in [0, bytes.len() / 2, bytes.len() - 60, bytes.len() - 1] {
                file.write_all_at(&[bytes[at] ^ 1], at as u64).expect("written");
                assert!(check_file(path, &file, tail).is_err(), "{len}: byte {at}");
                file.write_all_at(&[bytes[at]], at as u64).expect("written");
            }
        }
    }

    #[test]
    fn a_file_sealed_at_its_end_is_the_file_sealed_whole() {
        let (head, end) = ("some bytes ".as_bytes(), format!("{} and a tail", blank()).into_bytes());
        let whole = close([head, &end].concat());
        let (end, hash) = close_end(blake3::Hasher::new().update(head), end);
        assert_eq!(([head, &end].concat(), hash), (whole.clone(), blake3::hash(&whole)));
    }

    #[test]
    fn an_edited_version_is_named() {
        let whole = close(format!("{{\\\"schema_version\\\":1}} {}", blank()).into_bytes());
        let edited = String::from_utf8(whole).expect("text").replace(":1}", ":7}");
        let message = check(Path::new("f"), edited.as_bytes()).unwrap_err().to_string();
        assert!(message.contains("schema version 7"), "{message}");
    }
}
