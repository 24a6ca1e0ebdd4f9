//! The columns of a dataset: names, shapes, and how an episode fills them.

use super::episode::DatasetEpisode;
use crate::layout::{Layout, Span};
use crate::state::CONTROL_HZ;
use arrow_array::{ArrayRef, BooleanArray, FixedSizeListArray, Float32Array, Int64Array};
use arrow_schema::{DataType, Field, Metadata};
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

/// Type of a column's numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    F32,
    I64,
    Bool,
}

impl Kind {
    /// LeRobot's name of it.
    pub(super) fn dtype(self) -> &'static str {
        match self {
            Kind::F32 => "float32",
            Kind::I64 => "int64",
            Kind::Bool => "bool",
        }
    }

    /// The number of a key of [`Cells::for_each`].
    pub(super) fn value(self, key: u64) -> f64 {
        match self {
            Kind::F32 => f64::from(f32::from_bits(if key & F32_SIGN == 0 { !(key as u32) } else { (key ^ F32_SIGN) as u32 })),
            Kind::I64 => (key ^ I64_SIGN) as i64 as f64,
            Kind::Bool => key as f64,
        }
    }
}

/// Bits of the sign.
const F32_SIGN: u64 = 1 << 31;
const I64_SIGN: u64 = 1 << 63;

/// A column: `width` numbers a row; a scalar when that is 1.
#[derive(Clone, Debug)]
pub(super) struct Feature {
    pub(super) name: &'static str,
    pub(super) kind: Kind,
    pub(super) width: usize,
    /// Names with units of the entries of a vector.
    pub(super) names: Option<Vec<String>>,
    pub(super) doc: &'static str,
}

/// Names of the entries of these spans.
pub(in crate::data) fn names(spans: &[Span]) -> Vec<String> {
    spans.iter().flat_map(|span| span.entries.iter().cloned()).collect()
}

/// All columns, in order.
pub(super) fn features(layout: &Layout) -> Vec<Feature> {
    let (states, actions) = (names(&layout.state), names(&layout.action));
    let (body, world) = states.split_at(layout.proprioception());
    let vector =
        |name, names: &[String], doc| Feature { name, kind: Kind::F32, width: names.len(), names: Some(names.to_vec()), doc };
    let scalar = |name, kind, doc| Feature { name, kind, width: 1, names: None, doc };
    vec![
        vector(STATE, body, "joint positions [rad, m], then joint velocities [rad/s, m/s], before the action"),
        vector(ENVIRONMENT, world, "pose of the block [m, unit quaternion], then the task's constants (goal or base block)"),
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

/// Values of a column, row-major.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Cells {
    F32(Vec<f32>),
    I64(Vec<i64>),
    Bool(Vec<bool>),
}

impl Cells {
    /// As f64, flags as 0 and 1.
    pub(super) fn to_f64(&self) -> Vec<f64> {
        match self {
            Cells::F32(v) => v.iter().map(|x| f64::from(*x)).collect(),
            Cells::I64(v) => v.iter().map(|x| *x as f64).collect(),
            Cells::Bool(v) => v.iter().map(|x| f64::from(u8::from(*x))).collect(),
        }
    }

    /// Number of values.
    pub(super) fn len(&self) -> usize {
        match self {
            Cells::F32(v) => v.len(),
            Cells::I64(v) => v.len(),
            Cells::Bool(v) => v.len(),
        }
    }

    /// Shows every value, column by column, with its place in its row of `width` and with a key that sorts as the values do.
    pub(super) fn for_each(&self, width: usize, mut take: impl FnMut(usize, f64, u64)) {
        let key = |x: f32| u64::from(if x.is_sign_negative() { !x.to_bits() } else { x.to_bits() | F32_SIGN as u32 });
        match self {
            Cells::F32(v) => by_column(v, width, |at, x| take(at, f64::from(x), key(x))),
            Cells::I64(v) => by_column(v, width, |at, x| take(at, x as f64, x as u64 ^ I64_SIGN)),
            Cells::Bool(v) => by_column(v, width, |at, x| take(at, f64::from(u8::from(x)), u64::from(x))),
        }
    }

    /// Adds the values to `bytes`, which [`Cells::of_bytes`] reads.
    pub(super) fn push_bytes(&self, bytes: &mut Vec<u8>) {
        match self {
            Cells::F32(v) => v.iter().for_each(|x| bytes.extend(x.to_le_bytes())),
            Cells::I64(v) => v.iter().for_each(|x| bytes.extend(x.to_le_bytes())),
            Cells::Bool(v) => v.iter().for_each(|x| bytes.push(u8::from(*x))),
        }
    }

    /// The inverse of [`Cells::push_bytes`].
    pub(super) fn of_bytes(kind: Kind, bytes: &[u8]) -> Self {
        match kind {
            Kind::F32 => Cells::F32(bytes.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect()),
            Kind::I64 => Cells::I64(bytes.as_chunks().0.iter().map(|b| i64::from_le_bytes(*b)).collect()),
            Kind::Bool => Cells::Bool(bytes.iter().map(|b| *b != 0).collect()),
        }
    }

    /// As an Arrow column of `width` numbers a row.
    pub(super) fn to_array(&self, width: usize) -> ArrayRef {
        let flat: ArrayRef = match self {
            Cells::F32(v) => Arc::new(Float32Array::from(v.clone())),
            Cells::I64(v) => Arc::new(Int64Array::from(v.clone())),
            Cells::Bool(v) => Arc::new(BooleanArray::from(v.clone())),
        };
        if width == 1 {
            return flat;
        }
        let item = Arc::new(Field::new_list_field(flat.data_type().clone(), true));
        Arc::new(FixedSizeListArray::new(item, width as i32, flat, None))
    }
}

/// One column after the other.
fn by_column<T: Copy>(values: &[T], width: usize, mut take: impl FnMut(usize, T)) {
    (0..width).for_each(|at| values.iter().skip(at).step_by(width).for_each(|x| take(at, *x)));
}

/// The Arrow field of a feature, its description and names in the metadata.
pub(super) fn field(feature: &Feature) -> Field {
    let item = match feature.kind {
        Kind::F32 => DataType::Float32,
        Kind::I64 => DataType::Int64,
        Kind::Bool => DataType::Boolean,
    };
    let kind = match feature.width {
        1 => item,
        width => DataType::FixedSizeList(Arc::new(Field::new_list_field(item, true)), width as i32),
    };
    let mut metadata = Metadata::new().with("doc", feature.doc);
    if let Some(names) = &feature.names {
        metadata.insert("names", names.join(","));
    }
    Field::new(feature.name, kind, false).with_metadata(metadata)
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
    let fill = |feature: &Feature| match feature.name {
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
pub(super) fn timestamp(frame: usize) -> f32 {
    (frame as f64 / f64::from(CONTROL_HZ)) as f32
}
