//! What is written to a place: the name that it must have, and what standing there it may replace.

use crate::data::atomic::{self, Target};
use crate::data::peek::{Format, PICTURE, Peeked, peek};
use crate::data::{dataset, live_file, onnx, recording};
use crate::error::{Error, Result};
use crate::interrupt;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

/// What is written to a place.
#[derive(Clone, Copy, Debug)]
pub enum Content {
    /// A table of this stage.
    Table(&'static str),
    /// Weights of this kind and stage.
    Weights(&'static str, &'static str),
    /// A summary of this stage.
    Summary(&'static str),
    /// A network in ONNX.
    Onnx,
    /// A URDF.
    Urdf,
    /// A manual page.
    Man,
    /// A PNG picture.
    Png,
    /// A GIF animation.
    Gif,
    /// A chart.
    Svg,
    /// Lines for other programs: what stands there already has no sign of who wrote it.
    Csv,
    /// Metrics of a training as it goes.
    Live,
    /// A directory of TensorBoard's event files.
    Events,
    /// A page to look at episodes.
    Page,
    /// A recording of this stage.
    Recording(&'static str),
    /// A directory of recordings of this stage.
    Recordings(&'static str),
    /// A directory with the two datasets of this stage.
    Datasets(&'static str),
    /// One dataset.
    Dataset,
    /// A directory with a page, figures and tables.
    Report,
    /// A directory of finished pieces, in which other runs may have theirs: nothing in it is replaced.
    Pieces,
    /// What the command reads as well, and replaces on purpose.
    Own,
    /// Words of the process.
    Log,
}

/// Endings of other formats; what follows another dot belongs to a name (policy-0.1).
const ENDINGS: [&str; 18] = [
    "parquet",
    "safetensors",
    "onnx",
    "urdf",
    "json",
    "jsonl",
    "png",
    "gif",
    "html",
    "svg",
    "log",
    "mcap",
    "toml",
    "txt",
    "csv",
    "pt",
    "pth",
    "bin",
];

fn is_stream(path: &Path) -> bool {
    matches!(atomic::target(path), Ok(Target::Stream(_)))
}

/// An output's name ends as its format does, so that other tools know it, and what goes beside it has a name of its own.
pub(super) fn check_ending(name: &str, path: &Path, content: Content) -> Result<()> {
    let (ending, format) = match content {
        Content::Table(_) => ("parquet", "a Parquet file"),
        Content::Weights(..) => ("safetensors", "a safetensors file"),
        Content::Summary(_) => ("json", "a JSON file"),
        Content::Onnx => ("onnx", "an ONNX file"),
        Content::Urdf => ("urdf", "a URDF"),
        Content::Man => ("1", "a manual page"),
        Content::Png => ("png", "a PNG picture"),
        Content::Gif => ("gif", "a GIF animation"),
        Content::Svg => ("svg", "an SVG picture"),
        Content::Csv => ("csv", "a CSV file"),
        Content::Live => (live_file::ENDING, "a file with a line of JSON an epoch"),
        Content::Page => ("html", "a page"),
        Content::Recording(_) => ("mcap", "a recording"),
        Content::Log => ("log", "a log"),
        Content::Recordings(_)
        | Content::Datasets(_)
        | Content::Dataset
        | Content::Report
        | Content::Pieces
        | Content::Own
        | Content::Events => return Ok(()),
    };
    if matches!(atomic::target(path)?, Target::Stream(_)) || path.extension() == Some(OsStr::new(ending)) {
        return Ok(());
    }
    let known = path.extension().and_then(OsStr::to_str).is_some_and(|e| ENDINGS.contains(&e));
    let better = if known { path.with_extension(ending) } else { PathBuf::from(format!("{}.{ending}", path.display())) };
    let (shown, better) = (path.display(), better.display());
    Err(Error::Usage(format!("{name} {shown}: {format} is written there, its name must end in .{ending}: {better}")))
}

/// What stands in an output's place must be of the same kind, from the same stage.
pub(super) fn check_held(name: &str, path: &Path, content: Content) -> Result<()> {
    let (format, stage, kind) = match content {
        Content::Table(stage) => (Format::Parquet, Some(stage), None),
        Content::Weights(kind, stage) => (Format::Safetensors, Some(stage), Some(kind)),
        Content::Summary(stage) => (Format::Json, Some(stage), None),
        Content::Onnx => (Format::Onnx, Some(onnx::EXPORT), None),
        Content::Urdf | Content::Man => (Format::Marked, None, None),
        Content::Png => (Format::Png, Some(PICTURE), None),
        Content::Gif => (Format::Gif, Some(PICTURE), None),
        Content::Page => (Format::Html, Some("view"), None),
        Content::Recording(stage) => (Format::Mcap, Some(stage), None),
        Content::Pieces | Content::Own | Content::Events => return Ok(()),
        Content::Svg | Content::Csv | Content::Live | Content::Log => return check_text(name, path, content),
        Content::Datasets(stage) => return check_dataset(name, path, stage),
        Content::Dataset => return check_dataset(name, path, EDITED),
        Content::Report => return check_report(name, path),
        Content::Recordings(stage) => return check_recordings(name, path, stage),
    };
    if is_stream(path) || !path.is_file() {
        return Ok(());
    }
    let found = peek(path).map_err(|e| Error::io(path, "read", e))?;
    let Some(holds) = differs(&found, format, stage, kind) else { return Ok(()) };
    let path = path.display();
    Err(Error::Usage(format!("{name} {path}: holds {holds}, which would be lost; move it away or choose another name")))
}

/// Text that stands in the place of text: only what is known to be of the same kind is replaced.
fn check_text(name: &str, path: &Path, content: Content) -> Result<()> {
    let empty = fs::metadata(path).is_ok_and(|found| found.len() == 0);
    let ours = || match content {
        Content::Svg => is_chart(path),
        Content::Live => live_file::is_ours(path),
        Content::Log => begins_as_a_log(path),
        _ => false,
    };
    if is_stream(path) || !path.is_file() || empty || ours() {
        return Ok(());
    }
    let path = path.display();
    Err(Error::Usage(format!("{name} {path}: is there already, and would be lost; move it away or choose another name")))
}

/// Whether a file begins as a chart of hilt does; other programs begin theirs otherwise.
fn is_chart(path: &Path) -> bool {
    let head = interrupt::read_at_most(path, LONGEST_TAG).unwrap_or_default();
    let head = String::from_utf8_lossy(&head);
    let tag = head.split_once('>').map_or("", |(tag, _)| tag);
    tag.starts_with("<svg ") && CHART.iter().all(|part| tag.contains(part))
}

/// What the first tag of a chart says, and how long it is at most.
const CHART: [&str; 2] = ["role=\"img\"", "aria-label"];
const LONGEST_TAG: u64 = 4096;

/// Whether the first line of a file is one of a log: `train: ...`, or a time.
fn begins_as_a_log(path: &Path) -> bool {
    let head = interrupt::read_at_most(path, LONGEST_STAGE).unwrap_or_default();
    let text = String::from_utf8_lossy(&head);
    let is_stage = |word: &str| !word.is_empty() && word.bytes().all(|b| b.is_ascii_lowercase() || b == b'-');
    text.split_once(": ").is_some_and(|(stage, _)| is_stage(stage)) || text.starts_with("processor time ")
}

/// Longest name of a stage or task that a log's line begins with.
const LONGEST_STAGE: u64 = 64;

/// The stage of datasets that `hilt dataset` has made of others.
pub const EDITED: &str = "dataset";

/// A dataset that another program or stage wrote has the same files, but is not this one's to replace.
fn check_dataset(name: &str, dir: &Path, stage: &str) -> Result<()> {
    let Some(holds) = dataset::foreign::of_others(dir, stage) else { return Ok(()) };
    let dir = dir.display();
    Err(Error::Usage(format!("{name} {dir}: holds {holds}, which would be lost; choose another directory")))
}

/// Pages, figures and tables have the names that anybody gives them: a report replaces a report alone.
fn check_report(name: &str, dir: &Path) -> Result<()> {
    let seen = |entry: &fs::DirEntry| !entry.file_name().as_encoded_bytes().starts_with(b".");
    let empty = fs::read_dir(dir).map_or(true, |entries| !entries.flatten().any(|entry| seen(&entry)));
    let ours = || peek(&dir.join("index.html")).is_ok_and(|found| found.stage.as_deref() == Some("report"));
    if empty || ours() {
        return Ok(());
    }
    let dir = dir.display();
    Err(Error::Usage(format!(
        "{name} {dir}: is not empty and has no index.html of hilt report; what is there would be lost; choose another directory"
    )))
}

/// Recordings in a directory are replaced by recordings of the same stage alone.
fn check_recordings(name: &str, dir: &Path, stage: &'static str) -> Result<()> {
    if !dir.is_dir() {
        return Ok(());
    }
    for file in recording::files(dir)? {
        let found = peek(&file).map_err(|e| Error::io(&file, "read", e))?;
        if let Some(holds) = differs(&found, Format::Mcap, Some(stage), None) {
            let (dir, file) = (dir.display(), file.file_name().unwrap_or_default().display());
            let message = format!("{name} {dir}: {file} in it holds {holds}, which would be lost; choose another directory");
            return Err(Error::Usage(message));
        }
    }
    Ok(())
}

/// In words, what a file holds that must not be replaced by `format`, `stage` and `kind`. A file that was cut short tells nothing, and is no loss.
fn differs(found: &Peeked, format: Format, stage: Option<&str>, kind: Option<&str>) -> Option<String> {
    if found.format == Format::Empty || (found.format == format && !found.whole) {
        return None;
    }
    if found.format != format {
        return Some("a file of another format".into());
    }
    match (stage, &found.stage) {
        (None, _) => None,
        (Some(_), None) => Some("a file that hilt did not write".into()),
        (Some(stage), Some(other)) if stage != other => Some(format!("an artefact of hilt {other}")),
        _ => match (kind, &found.kind) {
            (Some(kind), Some(other)) if kind != other => Some(format!("weights of another kind, a {other}")),
            _ => None,
        },
    }
}
