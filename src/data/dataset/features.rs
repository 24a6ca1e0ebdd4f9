//! The columns of a dataset: names, shapes, and how an episode fills them.

use super::cells::{Cells, Kind};
use super::episode::DatasetEpisode;
use crate::layout::{Layout, Span};
use crate::state::CONTROL_HZ;
use arrow_schema::{DataType, Field, Metadata};
use std::borrow::Cow;
use std::sync::Arc;

pub(super) const STATE: &str = "observation.state";
pub(super) const ENVIRONMENT: &str = "observation.environment_state";
pub(super) const NEXT_STATE: &str = "next.observation.state";
pub(super) const NEXT_ENVIRONMENT: &str = "next.observation.environment_state";
pub(super) const ACTION: &str = "action";
/// Not `action.executed`: LeRobot takes every feature whose name begins with "action" for an output of the policy.
pub(super) const EXECUTED: &str = "executed_action";
pub(super) const REWARD: &str = "next.reward";
pub(super) const DONE: &str = "next.done";
pub(super) const SUCCESS: &str = "next.success";
pub(super) const TIMESTAMP: &str = "timestamp";
pub(super) const FRAME: &str = "frame_index";
pub(super) const EPISODE: &str = "episode_index";
pub(super) const INDEX: &str = "index";
pub(super) const TASK: &str = "task_index";
pub(super) const SOURCE: &str = "source_episode";

/// A column: `width` numbers a row; a scalar when that is 1.
#[derive(Clone, Debug)]
pub(super) struct Feature {
    pub(super) name: Cow<'static, str>,
    pub(super) kind: Kind,
    pub(super) width: usize,
    /// Names with units of the entries of a vector.
    pub(super) names: Option<Vec<String>>,
    /// Empty where there is nothing to say.
    pub(super) doc: &'static str,
}

impl Feature {
    /// So many f32 a row.
    fn of(name: &'static str, width: usize, doc: &'static str) -> Self {
        Feature { name: name.into(), kind: Kind::F32, width, names: None, doc }
    }
}

/// Names of the entries of these spans.
pub(in crate::data) fn names(spans: &[Span]) -> Vec<String> {
    spans.iter().flat_map(|span| span.entries.iter().cloned()).collect()
}

/// All columns, in order.
pub(super) fn features(layout: &Layout) -> Vec<Feature> {
    let (states, actions) = (names(&layout.state), names(&layout.action));
    let (body, world) = states.split_at(layout.proprioception());
    let vector = |name, names: &[String], doc| Feature {
        kind: Kind::F32,
        names: Some(names.to_vec()),
        ..Feature::of(name, names.len(), doc)
    };
    let scalar = |name, kind, doc| Feature { kind, ..Feature::of(name, 1, doc) };
    vec![
        vector(STATE, body, "joint positions [rad, m], then joint velocities [rad/s, m/s], before the action"),
        vector(ENVIRONMENT, world, "poses of the objects [m, unit quaternion], then the task's places on the table [m]"),
        vector(ACTION, &actions, "joint velocities that the controller asked for [rad/s, m/s]"),
        vector(EXECUTED, &actions, "joint velocities that the motors were given: action + noise, clamped [rad/s, m/s]"),
        vector(NEXT_STATE, body, "observation.state after the action; keeps the last state of an episode"),
        vector(NEXT_ENVIRONMENT, world, "observation.environment_state after the action"),
        scalar(REWARD, Kind::F32, "reward of milestones reached by the action"),
        scalar(DONE, Kind::Bool, "whether this is the last action of its episode"),
        scalar(SUCCESS, Kind::Bool, "whether the task is solved after the action"),
        scalar(TIMESTAMP, Kind::F32, "frame_index / fps [s]"),
        scalar(FRAME, Kind::I64, "number of the frame in its episode"),
        scalar(EPISODE, Kind::I64, "number of the episode in this dataset"),
        scalar(INDEX, Kind::I64, "number of the frame in this dataset"),
        scalar(TASK, Kind::I64, "row of meta/tasks.parquet"),
        scalar(SOURCE, Kind::I64, "number of the episode in the recordings"),
    ]
}

/// The Arrow field of a feature, its description and names in the metadata.
pub(super) fn field(feature: &Feature) -> Field {
    let item = match feature.kind {
        Kind::F32 => DataType::Float32,
        Kind::F64 => DataType::Float64,
        Kind::I64 => DataType::Int64,
        Kind::Bool => DataType::Boolean,
    };
    let kind = match feature.width {
        1 => item,
        width => DataType::FixedSizeList(Arc::new(Field::new_list_field(item, true)), width as i32),
    };
    let mut metadata = Metadata::new();
    if !feature.doc.is_empty() {
        metadata.insert("doc", feature.doc);
    }
    if let Some(names) = &feature.names {
        metadata.insert("names", names.join(","));
    }
    Field::new(feature.name.as_ref(), kind, false).with_metadata(metadata)
}

/// The columns of one episode. `number` is its place in the dataset, `first` that of its first frame.
pub(super) fn cells(features: &[Feature], episode: &DatasetEpisode, number: usize, first: usize) -> Vec<Cells> {
    let (demo, t_end) = (&episode.demo, episode.demo.len());
    let own = demo.layout().proprioception();
    let part = |from: usize, environment: bool| {
        let rows = (from..from + t_end).map(|t| demo.state(t));
        Cells::F32(rows.flat_map(|row| if environment { &row[own..] } else { &row[..own] }).copied().collect())
    };
    let each = |value: fn(usize, usize) -> i64, offset: usize| Cells::I64((0..t_end).map(|t| value(t, offset)).collect());
    let at_end = |flag: bool| Cells::Bool((0..t_end).map(|t| flag && t + 1 == t_end).collect());
    let fill = |feature: &Feature| match feature.name.as_ref() {
        STATE => part(0, false),
        ENVIRONMENT => part(0, true),
        NEXT_STATE => part(1, false),
        NEXT_ENVIRONMENT => part(1, true),
        ACTION => Cells::F32(demo.actions().to_vec()),
        EXECUTED => Cells::F32(demo.executed().to_vec()),
        REWARD => Cells::F32(episode.rewards.clone()),
        DONE => at_end(true),
        SUCCESS => at_end(episode.success),
        TIMESTAMP => Cells::F32((0..t_end).map(timestamp).collect()),
        FRAME => each(|t, _| t as i64, 0),
        INDEX => each(|t, first| (first + t) as i64, first),
        EPISODE => each(|_, number| number as i64, number),
        SOURCE => Cells::I64(vec![episode.source_index as i64; t_end]),
        // A dataset holds one task: row 0.
        _ => Cells::I64(vec![0; t_end]),
    };
    features.iter().map(fill).collect()
}

/// Time of a frame since the start of its episode \[s\].
fn timestamp(frame: usize) -> f32 {
    timestamp_at(frame, f64::from(CONTROL_HZ))
}

/// The same at another rate \[Hz\].
pub(super) fn timestamp_at(frame: usize, fps: f64) -> f32 {
    (frame as f64 / fps) as f32
}
