//! What a command reads and writes, checked before any work: nothing of the user's is replaced that the command does not replace on purpose.

use super::Console;
use crate::data::atomic::{self, Target};
use crate::data::peek::{Format, Peeked, peek};
use crate::data::{dataset, live_file, onnx, recording, tensorboard};
use crate::error::{Error, Result};
use crate::interrupt;
use crate::report::experiments;
use std::ffi::OsStr;
use std::fs;
use std::os::unix::fs::MetadataExt;
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
    /// A directory with the two datasets.
    Datasets,
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

/// Inputs and outputs of one command.
#[derive(Debug, Default)]
pub struct Places {
    reads: Vec<PathBuf>,
    writes: Vec<(&'static str, PathBuf, Content)>,
}

impl Places {
    /// None yet.
    pub fn new() -> Self {
        Places::default()
    }

    /// Adds an input.
    pub fn read(mut self, path: &Path) -> Self {
        self.reads.push(path.to_path_buf());
        self
    }

    /// Adds inputs.
    pub fn read_all<'a>(self, paths: impl IntoIterator<Item = &'a Path>) -> Self {
        paths.into_iter().fold(self, Places::read)
    }

    /// Adds an output; `name` is the flag that sets it, or what it is.
    pub fn write(mut self, name: &'static str, path: &Path, content: Content) -> Self {
        self.writes.push((name, path.to_path_buf(), content));
        self
    }

    /// Checks all of them, then begins the log.
    ///
    /// # Errors
    /// [`Error::Usage`] when an output has another format's ending, is an input or lies in one, is another output, or holds the artefact of
    /// another stage or program; [`Error::Input`] and [`Error::Io`] when it cannot be written there.
    pub fn check(mut self, console: &Console) -> Result<()> {
        if let Some(log) = console.log_path() {
            self = self.write("--log", log, Content::Log);
        }
        // A place on a file system that does not answer: a signal ends the process, nothing is lost.
        let waits = interrupt::waiting();
        for (name, path, content) in &self.writes {
            check_ending(name, path, *content)?;
        }
        self.check_apart()?;
        for (name, path, content) in &self.writes {
            check_held(name, path, *content)?;
            match content {
                Content::Recordings(_) => atomic::check_directory(path, recording::is_file)?,
                Content::Datasets => atomic::check_directory(path, dataset::is_file)?,
                Content::Dataset => atomic::check_directory(path, dataset::is_root_file)?,
                Content::Report => atomic::check_directory(path, experiments::is_file)?,
                Content::Events => atomic::check_directory(path, tensorboard::is_file)?,
                Content::Pieces => atomic::check_place(&path.join("a piece"))?,
                _ => atomic::check_place(path)?,
            }
        }
        drop(waits);
        console.open_log()
    }

    /// No output is an input, or another output, or stands inside one.
    fn check_apart(&self) -> Result<()> {
        for (i, (name, path, _)) in self.writes.iter().enumerate() {
            let Some(place) = place_of(path)? else { continue };
            for input in &self.reads {
                let refused = |how: &str| {
                    let (path, input) = (path.display(), input.display());
                    Err(Error::Usage(format!("{name} {path}: {how} {input}, which this command reads; choose another place")))
                };
                match place_of(input)? {
                    Some(other) if same(&place, &other) => return refused("is"),
                    Some(other) if other.starts_with(&place) => return refused("would replace"),
                    Some(other) if place.starts_with(&other) => return refused("lies in"),
                    _ => {}
                }
            }
            for (other_name, other, _) in &self.writes[..i] {
                let apart = place_of(other)?
                    .is_none_or(|other| !same(&place, &other) && !other.starts_with(&place) && !place.starts_with(&other));
                if !apart {
                    let (path, other) = (path.display(), other.display());
                    let message =
                        format!("{other_name} {other} and {name} {path} are written by this command, to one place; choose two");
                    return Err(Error::Usage(message));
                }
            }
        }
        Ok(())
    }
}

/// The place of a file or directory, links followed; `None` for a device or a pipe, which takes any number of readers and writers.
fn place_of(path: &Path) -> Result<Option<PathBuf>> {
    if let Ok(found) = fs::canonicalize(path)
        && found.is_dir()
    {
        return Ok(Some(found));
    }
    match atomic::target(path) {
        Ok(Target::File(place)) => Ok(Some(place)),
        Ok(Target::Stream(_)) => Ok(None),
        // Said better where it is opened or written.
        Err(_) => Ok(Some(path.to_path_buf())),
    }
}

/// The same file, by its place or by another name of it.
fn same(one: &Path, other: &Path) -> bool {
    let number = |path: &Path| fs::metadata(path).map(|found| (found.dev(), found.ino())).ok();
    one == other || number(one).is_some_and(|n| number(other) == Some(n))
}

fn is_stream(path: &Path) -> bool {
    matches!(atomic::target(path), Ok(Target::Stream(_)))
}

/// An output's name ends as its format does, so that other tools know it, and what goes beside it has a name of its own.
fn check_ending(name: &str, path: &Path, content: Content) -> Result<()> {
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
        | Content::Datasets
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
fn check_held(name: &str, path: &Path, content: Content) -> Result<()> {
    let (format, stage, kind) = match content {
        Content::Table(stage) => (Format::Parquet, Some(stage), None),
        Content::Weights(kind, stage) => (Format::Safetensors, Some(stage), Some(kind)),
        Content::Summary(stage) => (Format::Json, Some(stage), None),
        Content::Onnx => (Format::Onnx, Some(onnx::EXPORT), None),
        Content::Urdf | Content::Man => (Format::Marked, None, None),
        Content::Png => (Format::Png, None, None),
        Content::Gif => (Format::Gif, None, None),
        Content::Page => (Format::Html, Some("view"), None),
        Content::Recording(stage) => (Format::Mcap, Some(stage), None),
        Content::Log | Content::Report | Content::Pieces | Content::Own | Content::Events => return Ok(()),
        Content::Svg | Content::Csv | Content::Live => return check_text(name, path, content),
        Content::Datasets | Content::Dataset => return check_dataset(name, path),
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
        Content::Svg => fs::read(path).is_ok_and(|bytes| bytes.trim_ascii_start().starts_with(b"<svg")),
        Content::Live => live_file::is_ours(path),
        _ => false,
    };
    if is_stream(path) || !path.is_file() || empty || ours() {
        return Ok(());
    }
    let path = path.display();
    Err(Error::Usage(format!("{name} {path}: is there already, and would be lost; move it away or choose another name")))
}

/// A dataset that another program wrote has the same files, but is not hilt's to replace.
fn check_dataset(name: &str, dir: &Path) -> Result<()> {
    if !dataset::foreign::is_others(dir) {
        return Ok(());
    }
    let dir = dir.display();
    Err(Error::Usage(format!(
        "{name} {dir}: holds a dataset that hilt did not write, which would be lost; choose another directory"
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

/// A file that goes beside `out`: its name with `ending` in place of the format's own, which [`Places`] has checked.
pub fn beside(out: &Path, ending: &str) -> PathBuf {
    out.with_extension(ending)
}
