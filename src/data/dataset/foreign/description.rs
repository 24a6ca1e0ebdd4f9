//! `meta/info.json` of any LeRobotDataset v3.0.

use crate::data::ContentHash;
use crate::data::dataset::cells::Kind;
use crate::data::dataset::check::DESCRIPTION;
use crate::data::json_text;
use crate::error::{Error, Result};
use crate::layout::MOST_ENTRIES;
use crate::words::shown;
use serde_json::{Map, Value};
use std::path::{Component, Path};

pub(super) const INFO: &str = "meta/info.json";
/// The layout that hilt reads.
const VERSION: &str = "v3.0";
/// Fastest that anything is sampled at \[Hz\]: more is a slip.
const MOST_FPS: f64 = 100_000.0;
/// Slowest \[Hz\]: a layout has no longer period.
const LEAST_FPS: f64 = 0.1;

/// What a dataset says of itself.
#[derive(Clone, Debug, PartialEq)]
pub struct Info {
    /// Frames per second.
    pub fps: f64,
    /// Whatever the recording program called its robot.
    pub robot_type: Option<String>,
    /// Number of episodes.
    pub episodes: usize,
    /// Number of frames.
    pub frames: usize,
    /// The columns, in the order of their names.
    pub features: Vec<Declared>,
    /// Where a data file is, with the places of its two numbers.
    pub data_path: String,
    /// Of the description.
    pub hash: ContentHash,
}

/// A column as the description declares it.
#[derive(Clone, Debug, PartialEq)]
pub struct Declared {
    /// Its name.
    pub name: String,
    /// LeRobot's name of its type.
    pub dtype: String,
    /// Sizes of what a row has, outermost first.
    pub shape: Vec<usize>,
    /// Names of the entries, if there is one for each.
    pub names: Option<Vec<String>>,
}

impl Declared {
    /// Numbers of a row.
    pub fn width(&self) -> usize {
        self.shape.iter().product()
    }

    /// The type of its numbers; `None` of what holds none (texts, pictures, videos).
    pub(in crate::data::dataset) fn kind(&self) -> Option<Kind> {
        match self.dtype.as_str() {
            "float32" | "float16" | "bfloat16" => Some(Kind::F32),
            "float64" => Some(Kind::F64),
            "bool" => Some(Kind::Bool),
            "int8" | "int16" | "int32" | "int64" | "uint8" | "uint16" | "uint32" | "uint64" => Some(Kind::I64),
            _ => None,
        }
    }

    /// Whether it holds numbers that a state or an action can be made of.
    pub fn is_numeric(&self) -> bool {
        self.kind().is_some_and(|kind| kind != Kind::Bool)
    }

    /// Whether it holds pictures, in a file of its own or in the rows.
    pub fn is_picture(&self) -> bool {
        ["video", "image"].contains(&self.dtype.as_str())
    }

    /// The names of its entries, made of its own where they have none.
    pub fn entries(&self) -> Vec<String> {
        match &self.names {
            Some(names) => names.clone(),
            None if self.width() == 1 => vec![self.name.clone()],
            None => (0..self.width()).map(|i| format!("{}.{i}", self.name)).collect(),
        }
    }
}

impl Info {
    /// Reads and checks the description of the dataset at `root`.
    ///
    /// # Errors
    /// [`Error::Input`] with what is wrong and what to do; [`Error::Io`].
    pub fn read(root: &Path) -> Result<Info> {
        let path = root.join(INFO);
        if !path.is_file() {
            return Err(Error::input(root, format!("is no dataset: {INFO} is missing")));
        }
        let bytes = DESCRIPTION.read(&path)?;
        let value: Value = json_text::parse(&bytes).map_err(|why| Error::input(&path, format!("cannot be read: {why}")))?;
        of_value(&value, ContentHash::of(&bytes)).map_err(|why| Error::input(&path, why))
    }

    /// The declared column of this name.
    pub fn feature(&self, name: &str) -> Option<&Declared> {
        self.features.iter().find(|feature| feature.name == name)
    }

    /// Path of a data file below the root.
    pub(super) fn data_file(&self, chunk: usize, file: usize) -> String {
        filled(&self.data_path, chunk, file).expect("a checked template")
    }
}

fn of_value(value: &Value, hash: ContentHash) -> std::result::Result<Info, String> {
    let version = value.get("codebase_version").and_then(Value::as_str).unwrap_or("none");
    if version != VERSION {
        return Err(wrong_version(version));
    }
    let number = |key: &str| value.get(key).and_then(Value::as_f64).ok_or_else(|| format!("has no number \"{key}\""));
    let count = |key: &str| {
        let found = value.get(key).and_then(Value::as_u64).and_then(|n| usize::try_from(n).ok());
        found.ok_or_else(|| format!("has no whole number \"{key}\""))
    };
    let fps = number("fps")?;
    if !(LEAST_FPS..=MOST_FPS).contains(&fps) {
        return Err(format!("has {fps} frames per second; allowed: {LEAST_FPS} to {MOST_FPS}"));
    }
    let features = value.get("features").and_then(Value::as_object).ok_or("declares no \"features\"")?;
    let data_path = value.get("data_path").and_then(Value::as_str).ok_or("has no \"data_path\"")?;
    check_template(data_path)?;
    Ok(Info {
        fps,
        robot_type: value.get("robot_type").and_then(Value::as_str).map(String::from),
        episodes: count("total_episodes")?,
        frames: count("total_frames")?,
        features: declared(features)?,
        data_path: data_path.into(),
        hash,
    })
}

fn wrong_version(version: &str) -> String {
    let shown = shown(version);
    let older = version.starts_with("v2") || version.starts_with("v1");
    let advice = match older {
        true => {
            "convert it first: python -m lerobot.scripts.convert_dataset_v21_to_v30 --repo-id=NAME --root=DIR --push-to-hub=false"
        }
        false => "is it a LeRobotDataset at all, or one of a newer LeRobot?",
    };
    format!("has codebase_version \"{shown}\", hilt reads \"{VERSION}\"; {advice}")
}

fn declared(features: &Map<String, Value>) -> std::result::Result<Vec<Declared>, String> {
    let one = |(name, entry): (&String, &Value)| {
        let cut = shown(name);
        let dtype = entry.get("dtype").and_then(Value::as_str).ok_or_else(|| format!("feature {cut} has no \"dtype\""))?;
        let shape = entry.get("shape").and_then(|s| serde_json::from_value::<Vec<usize>>(s.clone()).ok());
        let mut shape = shape.ok_or_else(|| format!("feature {cut} has no \"shape\", a list of whole numbers"))?;
        // A scalar.
        if shape.is_empty() {
            shape.push(1);
        }
        let width = shape.iter().try_fold(1_usize, |all, n| all.checked_mul(*n));
        let mut feature = Declared { name: name.clone(), dtype: dtype.into(), shape, names: None };
        if feature.kind().is_some() && !width.is_some_and(|width| (1..=MOST_ENTRIES).contains(&width)) {
            return Err(format!("feature {cut} has shape {:?}; allowed: 1 to {MOST_ENTRIES} numbers in a row", feature.shape));
        }
        if feature.kind().is_some() {
            let mut names = Vec::new();
            entry.get("names").into_iter().for_each(|said| texts(said, &mut names));
            feature.names = (names.len() == feature.width()).then_some(names);
        }
        Ok(feature)
    };
    features.iter().map(one).collect()
}

/// All texts in a value: names come as a list, as a list in an object (`{"motors": [...]}`), or as none.
fn texts(value: &Value, found: &mut Vec<String>) {
    match value {
        Value::String(text) => found.push(text.clone()),
        Value::Array(items) => items.iter().for_each(|item| texts(item, found)),
        Value::Object(fields) => fields.values().for_each(|field| texts(field, found)),
        _ => {}
    }
}

/// A template stays below the root and has the places of both numbers.
fn check_template(template: &str) -> std::result::Result<(), String> {
    let refuse = || {
        let example = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet";
        format!("has data_path \"{}\"; expected one like \"{example}\"", shown(template))
    };
    let one = filled(template, 0, 0).ok_or_else(refuse)?;
    let plain = Path::new(&one).components().all(|part| matches!(part, Component::Normal(_)));
    let tells =
        filled(template, 1, 0).is_some_and(|other| other != one) && filled(template, 0, 1).is_some_and(|other| other != one);
    if plain && tells { Ok(()) } else { Err(refuse()) }
}

/// A template with its numbers: Python's `{chunk_index:03d}` and `{file_index:03d}`, of any width.
fn filled(template: &str, chunk: usize, file: usize) -> Option<String> {
    let (mut out, mut rest) = (String::new(), template);
    while let Some((before, after)) = rest.split_once('{') {
        let (field, after) = after.split_once('}')?;
        let (name, format) = field.split_once(':').unwrap_or((field, ""));
        let number = match name {
            "chunk_index" => chunk,
            "file_index" => file,
            _ => return None,
        };
        let digits = format.strip_suffix('d').unwrap_or(format);
        let width: usize = if digits.is_empty() { 0 } else { digits.parse().ok().filter(|width| *width < 20)? };
        out += before;
        out += &format!("{number:0width$}");
        rest = after;
    }
    Some(out + rest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn info(change: impl Fn(&mut Value)) -> std::result::Result<Info, String> {
        let mut value = json!({
            "codebase_version": "v3.0", "fps": 30, "total_episodes": 2, "total_frames": 9,
            "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet", "robot_type": null,
            "features": {
                "action": { "dtype": "float32", "shape": [2], "names": { "motors": ["a", "b"] } },
                "observation.image": { "dtype": "video", "shape": [480, 640, 3], "names": ["h", "w", "c"] },
                "observation.state": { "dtype": "float64", "shape": [2, 2], "names": null },
            },
        });
        change(&mut value);
        of_value(&value, ContentHash::of(b""))
    }

    #[test]
    fn a_description_is_read_with_names_in_all_their_forms() {
        let found = info(|_| {}).expect("a description");
        assert_eq!(found.feature("action").expect("declared").entries(), ["a", "b"]);
        let state = found.feature("observation.state").expect("declared");
        assert_eq!(state.entries(), ["observation.state.0", "observation.state.1", "observation.state.2", "observation.state.3"]);
        assert!(!found.feature("observation.image").expect("declared").is_numeric());
        assert_eq!(found.data_file(0, 12), "data/chunk-000/file-012.parquet");
        assert_eq!(filled("d/{chunk_index}-{file_index:5d}", 7, 12).as_deref(), Some("d/7-00012"));
        let fractional = info(|v| v["fps"] = json!(29.97)).expect("a description");
        assert_eq!(fractional.fps, 29.97);
    }

    #[test]
    fn what_cannot_be_is_refused_in_words() {
        type Spoil = fn(&mut Value);
        let spoilt: [(Spoil, &str); 8] = [
            (|v| v["codebase_version"] = json!("v2.1"), "convert_dataset_v21_to_v30"),
            (|v| v["codebase_version"] = json!("v4.0"), "hilt reads \"v3.0\"; is it"),
            (|v| v["fps"] = json!(0), "0 frames per second"),
            (|v| v["data_path"] = json!("../x/{chunk_index}-{file_index}"), "expected one like"),
            (|v| v["data_path"] = json!("data/{episode_chunk}/{file_index}"), "expected one like"),
            (|v| v["data_path"] = json!("data/{chunk_index}.parquet"), "expected one like"),
            (|v| v["features"]["action"]["shape"] = json!([u64::MAX, 2]), "feature action has shape"),
            (|v| v["total_frames"] = json!(-1), "no whole number \"total_frames\""),
        ];
        for (spoil, said) in spoilt {
            let why = info(spoil).expect_err(said);
            assert!(why.contains(said), "{why}");
        }
    }
}
