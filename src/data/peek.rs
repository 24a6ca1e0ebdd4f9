//! What a file is that stands where another is to be written: told from its head and its tail, without reading it whole.

use super::onnx::{EXPORT, PRODUCER};
use super::provenance::KEY;
use super::seal::find_last;
use super::{json_text, marked};
use crate::interrupt;
use prost::encoding::{WireType, decode_varint};
use serde_json::Value;
use std::fs::File;
use std::io::{Read, Result, Seek, SeekFrom};
use std::path::Path;

/// Enough for what tells formats apart.
const HEAD: u64 = 16;
/// Where a provenance is looked for: the header of weights, the metadata at the end of tables and recordings. Each is a few kilobytes long.
const REACH: u64 = 1 << 18;

/// A longer JSON file is no summary; it is not read.
const LONGEST_JSON: u64 = 1 << 26;
/// Bytes of the number at the beginning of weights that gives their header's length.
const LENGTH: u64 = 8;
/// What a provenance's text has before and behind its stage.
const VERSION: &[u8] = b"\"schema_version\":";
const STAGE: &[u8] = b"\"stage\":\"";
/// Keys of the first two fields of ONNX files: the format's version in one byte, then the name of the program that wrote it.
const ONNX_VERSION: u8 = 0x08;
const ONNX_PRODUCER: u8 = 0x12;
/// Bytes of a field's key and of the number that follows, at most.
const LONGEST_KEY: u64 = 20;
/// How a page begins, and what stands in its first bytes before the stage of hilt that made it.
const DOCTYPE: &[u8] = b"<!DOCTYPE html>";
const GENERATOR: &[u8] = b"<meta name=\"generator\" content=\"hilt ";
const PAGE_HEAD: u64 = 512;
/// What a picture of hilt says in a comment near its beginning, after at most 256 colours.
pub const PICTURE_MARK: &str = "by hilt ";
/// The stage that such a picture is taken for.
pub const PICTURE: &str = "picture";
const PICTURE_HEAD: u64 = 2048;
/// The stage comes within so many bytes after the version.
const NEAR: usize = 64;

/// The format of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// No bytes.
    Empty,
    /// Parquet.
    Parquet,
    /// MCAP.
    Mcap,
    /// Safetensors.
    Safetensors,
    /// A JSON object, or the beginning of one.
    Json,
    /// PNG.
    Png,
    /// GIF.
    Gif,
    /// ONNX.
    Onnx,
    /// A text that hilt wrote for other programs.
    Marked,
    /// An HTML page.
    Html,
    /// None of these.
    Other,
}

/// What a glance at a file tells.
#[derive(Clone, Debug, PartialEq)]
pub struct Peeked {
    /// The format.
    pub format: Format,
    /// The stage of hilt that wrote it, where its provenance is found.
    pub stage: Option<String>,
    /// The kind of weights.
    pub kind: Option<String>,
    /// Whether the end that its format has is there; a file that was cut short has none.
    pub whole: bool,
}

/// Looks at a file.
///
/// # Errors
/// What the system says when it cannot be read.
pub fn peek(path: &Path) -> Result<Peeked> {
    let _waits = interrupt::waiting();
    let mut file = File::open(path)?;
    let size = file.metadata()?.len();
    let head = part(&mut file, 0, HEAD)?;
    let format = format_of(&head);
    let plain = Peeked { format, stage: None, kind: None, whole: true };
    Ok(match format {
        Format::Parquet => in_tail(&mut file, size, b"PAR1", format)?,
        Format::Mcap => in_tail(&mut file, size, mcap::MAGIC, format)?,
        Format::Safetensors => in_header(&mut file, size, &head)?,
        Format::Onnx => in_fields(&mut file, size, &head)?,
        Format::Html => in_page(&part(&mut file, 0, PAGE_HEAD)?),
        Format::Png | Format::Gif => in_picture(&part(&mut file, 0, PICTURE_HEAD)?, format),
        Format::Json if size <= LONGEST_JSON => in_json(&part(&mut file, 0, size)?),
        _ => plain,
    })
}

/// The format that a file's first bytes are of.
pub(super) fn format_of(head: &[u8]) -> Format {
    match head {
        [] => Format::Empty,
        [b'P', b'A', b'R', b'1', ..] => Format::Parquet,
        [0x89, b'P', b'N', b'G', ..] => Format::Png,
        [b'G', b'I', b'F', b'8', ..] => Format::Gif,
        [b'{', ..] => Format::Json,
        [_, _, _, _, _, 0, 0, 0, b'{', ..] => Format::Safetensors,
        // Two numbers of the beginning of every ONNX file: its version's field and its producer's.
        [ONNX_VERSION, _, ONNX_PRODUCER, ..] => Format::Onnx,
        _ if head.starts_with(DOCTYPE) => Format::Html,
        _ if head.starts_with(mcap::MAGIC) => Format::Mcap,
        _ if marked::is_ours(head) => Format::Marked,
        _ => Format::Other,
    }
}

/// Of a page: the stage of hilt that says to have made it.
fn in_page(head: &[u8]) -> Peeked {
    let stage = find_first(head, GENERATOR).map(|at| {
        let rest = &head[at + GENERATOR.len()..];
        rest.iter().take_while(|b| b.is_ascii_lowercase()).map(|b| char::from(*b)).collect()
    });
    Peeked { format: Format::Html, stage, kind: None, whole: true }
}

/// Of a picture: whether it says that hilt has drawn it.
fn in_picture(head: &[u8], format: Format) -> Peeked {
    let stage = find_first(head, PICTURE_MARK.as_bytes()).map(|_| PICTURE.into());
    Peeked { format, stage, kind: None, whole: true }
}

/// Of a table or a recording: the provenance's own text near the end.
fn in_tail(file: &mut File, size: u64, magic: &[u8], format: Format) -> Result<Peeked> {
    let tail = part(file, size.saturating_sub(REACH), REACH)?;
    let stage = find_last(&tail, VERSION).and_then(|at| {
        let rest = &tail[at + VERSION.len()..];
        let rest = &rest[find_first(&rest[..rest.len().min(NEAR)], STAGE)? + STAGE.len()..];
        let word: String = rest.iter().take_while(|b| b.is_ascii_lowercase()).map(|b| char::from(*b)).collect();
        Some(word)
    });
    Ok(Peeked { format, stage, kind: None, whole: tail.ends_with(magic) })
}

/// Of weights: the metadata in the header.
fn in_header(file: &mut File, size: u64, head: &[u8]) -> Result<Peeked> {
    let length = head.first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes));
    let header = part(file, LENGTH, length.min(REACH * LENGTH))?;
    let header: Option<Value> = json_text::parse(&header).ok();
    let text = header.as_ref().and_then(|h| h["__metadata__"][KEY].as_str());
    let hilt: Value = text.and_then(|text| json_text::parse(text.as_bytes()).ok()).unwrap_or_default();
    let word = |value: &Value| value.as_str().map(String::from);
    Ok(Peeked {
        format: Format::Safetensors,
        stage: word(&hilt["provenance"]["stage"]),
        kind: word(&hilt["kind"]),
        whole: header.is_some() && length.saturating_add(LENGTH) <= size,
    })
}

/// Of a network for other programs, a protobuf: who wrote it, and of our own whether its fields end where the file does.
fn in_fields(file: &mut File, size: u64, head: &[u8]) -> Result<Peeked> {
    let named = |(length, name): (&u8, &[u8])| usize::from(*length) == PRODUCER.len() && name.starts_with(PRODUCER.as_bytes());
    if !head.get(3..).and_then(<[u8]>::split_first).is_some_and(named) {
        return Ok(Peeked { format: Format::Onnx, stage: None, kind: None, whole: true });
    }
    let mut at = 0;
    while at < size {
        let bytes = part(file, at, LONGEST_KEY)?;
        at = field_end(&bytes).and_then(|length| at.checked_add(length)).unwrap_or(u64::MAX);
    }
    Ok(Peeked { format: Format::Onnx, stage: Some(EXPORT.into()), kind: None, whole: at == size })
}

/// Bytes of the field that begins here, whose value is a number or has its length before it.
fn field_end(bytes: &[u8]) -> Option<u64> {
    let mut rest = bytes;
    let (key, value) = (decode_varint(&mut rest).ok()?, decode_varint(&mut rest).ok()?);
    let length = match WireType::try_from(key & 7).ok()? {
        WireType::Varint => 0,
        WireType::LengthDelimited => value,
        _ => return None,
    };
    length.checked_add((bytes.len() - rest.len()) as u64)
}

fn in_json(text: &[u8]) -> Peeked {
    let content: Option<Value> = json_text::parse(text).ok();
    let stage = content.as_ref().and_then(|c| c[KEY]["provenance"]["stage"].as_str()).map(String::from);
    Peeked { format: Format::Json, stage, kind: None, whole: content.is_some() }
}

fn find_first(bytes: &[u8], needle: &[u8]) -> Option<usize> {
    bytes.windows(needle.len()).position(|window| window == needle)
}

fn part(file: &mut File, from: u64, length: u64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(from))?;
    file.take(length).read_to_end(&mut bytes)?;
    Ok(bytes)
}
