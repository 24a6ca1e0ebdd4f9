//! What a file is that stands where another is to be written: told from its head and its tail, without reading it whole.

use super::seal::find_last;
use serde_json::Value;
use std::fs::File;
use std::io::{Read, Result, Seek, SeekFrom};
use std::path::Path;

/// Enough for what tells formats apart.
const HEAD: u64 = 16;
/// Where a provenance is looked for: the header of weights, the metadata at the end of tables and recordings. Each is a few kilobytes long.
const REACH: u64 = 1 << 18;

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
    let mut file = File::open(path)?;
    let size = file.metadata()?.len();
    let head = part(&mut file, 0, HEAD)?;
    let format = format_of(&head, size);
    let (text, whole) = match format {
        Format::Parquet => ending(&mut file, size, b"PAR1")?,
        Format::Mcap => ending(&mut file, size, mcap::MAGIC)?,
        Format::Safetensors => (part(&mut file, 0, REACH)?, true),
        Format::Json => {
            let text = part(&mut file, 0, size.min(REACH * REACH))?;
            let whole = serde_json::from_slice::<Value>(&text).is_ok();
            (text, whole)
        }
        _ => (Vec::new(), true),
    };
    Ok(Peeked { format, stage: value_of(&text, "stage"), kind: value_of(&text, "kind"), whole })
}

fn format_of(head: &[u8], size: u64) -> Format {
    let header_fits = |length: [u8; 8]| u64::from_le_bytes(length).checked_add(8).is_some_and(|end| end <= size);
    match head {
        [] => Format::Empty,
        [b'P', b'A', b'R', b'1', ..] => Format::Parquet,
        [0x89, b'P', b'N', b'G', ..] => Format::Png,
        [b'G', b'I', b'F', b'8', ..] => Format::Gif,
        [b'{', ..] => Format::Json,
        [a, b, c, d, e, f, g, h, b'{', ..] if header_fits([*a, *b, *c, *d, *e, *f, *g, *h]) => Format::Safetensors,
        _ if head.starts_with(mcap::MAGIC) => Format::Mcap,
        _ => Format::Other,
    }
}

/// The last bytes, and whether the file ends as its format does.
fn ending(file: &mut File, size: u64, magic: &[u8]) -> Result<(Vec<u8>, bool)> {
    let tail = part(file, size.saturating_sub(REACH), REACH)?;
    let whole = tail.ends_with(magic);
    Ok((tail, whole))
}

fn part(file: &mut File, from: u64, length: u64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(from))?;
    file.take(length).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The text behind the last `"key":"`, as JSON has it, also within a JSON string and with a blank.
fn value_of(text: &[u8], key: &str) -> Option<String> {
    let forms = [format!("\"{key}\":\""), format!("\\\"{key}\\\":\\\""), format!("\"{key}\": \"")];
    let (at, form) = forms.iter().filter_map(|form| Some((find_last(text, form.as_bytes())?, form))).max()?;
    let rest = &text[at + form.len()..];
    let word: String = rest.iter().take_while(|b| b.is_ascii_lowercase()).map(|b| char::from(*b)).collect();
    Some(word).filter(|word| !word.is_empty())
}
