//! Recordings: one executed episode in one MCAP file.
//!
//! | topic | schema | what |
//! |---|---|---|
//! | `/tf` | foxglove.FrameTransforms | robot links by forward kinematics, objects |
//! | `/joint_states` | foxglove.JointStates | angle \[rad\] and velocity \[rad/s\] by URDF joint name |
//! | `/scene` | foxglove.SceneUpdate | table, objects, goals, obstacles: once, attached to their frames |
//! | `/robot_description` | std_msgs/msg/String | robot and surroundings as a URDF whose links are those frames: once |
//! | `/hilt/scene` | hilt.Scene | what stood where at the start: once |
//! | `/hilt/step` | hilt.Step | every control step, then the final state |
//! | `/hilt/outcome` | hilt.Outcome | success or failure class: once, at the end |
//!
//! The robot is attached twice: as `robot.urdf` for other programs, as `robot.json` with all that hilt knows of it; the task as `task.json`; the metadata record `hilt` holds provenance and seal. Times are simulated, from 0. MCAP's own
//! checksums hold as well: the one of the data section is computed last and covers the seal, which takes its place for zeros.

mod decode;
mod encode;
mod fields;
mod foxglove;
mod messages;
mod moment;
mod older;
mod records;
mod surroundings;
mod topics;
mod walk;

pub use surroundings::{WORLD_FRAME, frame_of, scene_urdf};

use super::bytes::{Ends, Format};
use super::{ContentHash, Provenance, atomic, provenance, seal};
use crate::demo::Episode;
use crate::error::{Error, Result};
use crate::guard::guarded;
use crate::interrupt;
use crate::robot::urdf;
use fields::Fields;
use mcap::records::Metadata;
use mcap::{Attachment, McapResult, WriteOptions};
use records::{Sections, op};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};
pub use topics::{DESCRIPTION_TOPIC, ROBOT_NAME, TASK_NAME, URDF_NAME};
use walk::Outline;

/// Key of the provenance in the metadata record.
const PROVENANCE: &str = "provenance";
/// Key of the seal in the metadata record.
const SEAL: &str = "seal";

/// Name of an episode's file, e.g. `episode-00042.mcap`.
pub fn file_name(index: u64) -> String {
    format!("episode-{index:05}.mcap")
}

/// The number in a name that [`file_name`] gives; `None` for every other name.
pub fn number_of(name: &str) -> Option<u64> {
    let digits = name.strip_prefix("episode-")?.strip_suffix(".mcap")?;
    digits.parse().ok().filter(|number| file_name(*number) == name)
}

/// Whether a path below a directory of recordings is one of a recording.
pub fn is_file(path: &Path) -> bool {
    path.to_str().and_then(number_of).is_some()
}

/// The recordings in a directory, by name; hidden and foreign files do not count.
///
/// # Errors
/// [`Error::Io`] when it cannot be read.
pub fn files(dir: &Path) -> Result<Vec<PathBuf>> {
    let _waits = interrupt::waiting();
    let entries = std::fs::read_dir(dir).map_err(|e| Error::io(dir, "read", e))?;
    let names = entries.map(|entry| entry.map(|e| e.file_name())).collect::<std::io::Result<Vec<_>>>();
    let names = names.map_err(|e| Error::io(dir, "read", e))?;
    let mut files: Vec<PathBuf> = names.iter().filter(|n| is_file(Path::new(n))).map(|n| dir.join(n)).collect();
    files.sort();
    Ok(files)
}

/// Writes an episode.
///
/// # Errors
/// As [`encode`]; [`Error::Io`] when the system refuses.
pub fn write(path: &Path, episode: &Episode, provenance: &Provenance) -> Result<()> {
    atomic::write_bytes(path, &encode(path, episode, provenance)?)
}

/// The bytes of the file that [`write()`] writes to `path`.
///
/// # Errors
/// [`Error::Input`] when a step's conditions do not fit the task.
pub fn encode(path: &Path, episode: &Episode, provenance: &Provenance) -> Result<Vec<u8>> {
    let expected = episode.scene.task.condition_names().len();
    if let Some(step) = episode.steps.iter().chain([&episode.last]).find(|s| s.conditions.len() != expected) {
        let message = format!("a step has {} conditions, {} has {expected}", step.conditions.len(), episode.scene.task.name);
        return Err(Error::input(path, message));
    }
    let bytes = to_mcap(episode, provenance).map_err(|e| Error::input(path, format!("cannot be encoded as MCAP: {e}")))?;
    Ok(close(bytes))
}

/// Fills in the seal and, last, the checksum of the data section, which covers it.
///
/// # Panics
/// If `bytes` are no whole MCAP file with a seal.
pub fn close(mut bytes: Vec<u8>) -> Vec<u8> {
    let sections = Sections::of(&bytes).expect("the writer finished the file");
    bytes[sections.data_crc()].fill(0);
    let mut bytes = seal::close(bytes);
    let crc = crc32fast::hash(&bytes[..sections.data_end]);
    bytes[sections.data_crc()].copy_from_slice(&crc.to_le_bytes());
    bytes
}

/// What a recording looks like from outside.
const FORMAT: Format = Format {
    most_bytes: 128 << 20,
    reason: "a recording of 20,000 steps, the most there can be, has some 30 MB",
    head: check_head,
    ends: check_ends,
};
/// The library's name that hilt notes in the header, before its version.
const LIBRARY: &str = "hilt ";

fn check_head(path: &Path, head: &[u8]) -> Result<()> {
    if !head.starts_with(mcap::MAGIC) {
        return Err(Error::input(path, "is not an MCAP file; expected a recording of hilt simulate"));
    }
    Ok(())
}

fn check_ends(path: &Path, ends: &Ends) -> Result<()> {
    if *ends.tail(path, mcap::MAGIC.len())? != *mcap::MAGIC {
        return Err(Error::input(path, "is an MCAP file without its end: it is cut short; run hilt simulate again"));
    }
    let head = ends.at(path, mcap::MAGIC.len() as u64, super::bytes::HEAD_BYTES)?;
    match library(&head) {
        Ok(library) if library.starts_with(LIBRARY) => Ok(()),
        Ok(other) => Err(Error::input(
            path,
            format!(
                "is an MCAP file that another program wrote or rewrote (\"{other}\"); hilt reads its own: run hilt simulate again"
            ),
        )),
        Err(why) => Err(Error::input(path, format!("is an MCAP file without a header ({why}); run hilt simulate again"))),
    }
}

/// The program that a header names.
fn library(head: &[u8]) -> std::result::Result<String, String> {
    let mut fields = Fields(head);
    if fields.u8()? != op::HEADER {
        return Err("its first record is another".into());
    }
    let mut content = Fields(fields.bytes64()?);
    let (_profile, library) = (content.text()?, content.text()?);
    Ok(library.into())
}

/// Reads an episode, exactly as it was written.
///
/// # Errors
/// [`Error::Input`] when the file is cut short, damaged, foreign or of another schema version, [`Error::Io`] when it cannot be read
/// at all.
pub fn read(path: &Path) -> Result<(Episode, Provenance)> {
    decode(path, &FORMAT.read(path)?)
}

/// As [`read`], with the hash of the bytes that were read.
///
/// # Errors
/// As [`read`].
pub fn read_hashed(path: &Path) -> Result<(Episode, Provenance, ContentHash)> {
    let bytes = FORMAT.read(path)?;
    decode(path, &bytes).map(|(episode, provenance)| (episode, provenance, ContentHash::of(&bytes)))
}

/// The episode in the bytes of the file at `path`.
///
/// # Errors
/// [`Error::Input`] as [`read`].
pub fn decode(path: &Path, bytes: &[u8]) -> Result<(Episode, Provenance)> {
    FORMAT.check(path, bytes)?;
    let damaged = |why: String| Error::input(path, format!("damaged: {why}; run hilt simulate again"));
    let sections = Sections::of(bytes).map_err(damaged)?;
    seal::check_but(path, bytes, sections.data_crc())?;
    sections.check_crcs(bytes).map_err(damaged)?;
    let decoded = guarded(|| {
        let outline = Outline::of(bytes, &sections).map_err(damaged)?;
        let entries = outline.metadata.get(provenance::KEY);
        let entries = entries.ok_or_else(|| Error::input(path, "was not written by hilt: it has no metadata record \"hilt\""))?;
        let provenance = Provenance::from_json(path, entries.get(PROVENANCE).unwrap_or(&""))?;
        let episode = decode::episode(&outline).map_err(|message| Error::input(path, message))?;
        Ok((episode, provenance))
    });
    decoded.unwrap_or_else(|why| Err(damaged(why)))
}

fn to_mcap(episode: &Episode, provenance: &Provenance) -> McapResult<Vec<u8>> {
    // The checksum of the whole data section covers the seal: `close` fills in both.
    let options = WriteOptions::new()
        .compression(Some(mcap::Compression::Zstd))
        .compression_threads(0)
        .calculate_data_section_crc(false)
        .library(concat!("hilt ", env!("CARGO_PKG_VERSION")));
    let mut writer = options.create(Cursor::new(Vec::new()))?;
    messages::write(&mut writer, episode)?;
    let robot = &*episode.scene.robot;
    let json = serde_json::to_vec(robot).expect("a robot is plain data with text keys");
    let task = serde_json::to_vec(&*episode.scene.task).expect("a task is plain data with text keys");
    let attachments = [
        (URDF_NAME, "application/xml", urdf(robot).into_bytes()),
        (ROBOT_NAME, "application/json", json),
        (TASK_NAME, "application/json", task),
    ];
    for (name, media_type, data) in attachments {
        let data = Cow::Owned(data);
        writer.attach(&Attachment { log_time: 0, create_time: 0, name: name.into(), media_type: media_type.into(), data })?;
    }
    let entries = [(PROVENANCE.to_string(), provenance.to_json()), (SEAL.to_string(), seal::blank())];
    writer.write_metadata(&Metadata { name: provenance::KEY.into(), metadata: BTreeMap::from(entries) })?;
    writer.finish()?;
    Ok(writer.into_inner().into_inner())
}
