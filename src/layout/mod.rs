//! What the entries of a state row and of an action row mean: named spans, units, control period, and the kinematics behind them. What is
//! recorded, learned and run carries a layout; nothing in learning knows more about robots and tasks than it says.

mod check;

use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Joints of the longest arm whose kinematics networks see.
pub const MOST_ARM_JOINTS: usize = 7;
/// Most objects that may move.
pub const MOST_OBJECTS: usize = 6;
/// Most [`Layout::aims`].
pub const MOST_AIMS: usize = 6;
/// Entries of the widest state and the widest action: more are no manipulation task's, but a damaged file's.
pub const MOST_ENTRIES: usize = 4096;
/// Entries of a pose: x y z \[m\], unit quaternion x y z w.
pub const POSE_DIM: usize = 7;
/// Entries of a point: x y z \[m\].
pub const POINT_DIM: usize = 3;

/// The layout of the rows of one task, or of one dataset.
///
/// ```
/// use hilt::robot::file::built_in::paper_robot;
/// use hilt::task::built_in::stack;
///
/// let layout = stack().layout(&paper_robot());
/// assert_eq!((layout.state_dim(), layout.action_dim()), (32, 9));
/// // Nine joint positions, nine velocities, then where the block is; where the base stands does not change.
/// assert_eq!((layout.proprioception(), layout.changing()), (18, 25));
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layout {
    /// The task, for messages.
    pub name: String,
    /// Control period \[s\].
    pub period_s: f64,
    /// Spans of a state row, in order. Those that stay as they are during an episode come last.
    pub state: Vec<Span>,
    /// Spans of an action row, in order.
    pub action: Vec<Span>,
    /// Largest value of each entry of an action, in its unit; empty where it is not known.
    pub action_limits: Vec<f64>,
    /// What counts for each entry of an action as a radian a second does: other joints than those that turn have other scales. Negative where a
    /// negative command closes a finger. Empty where it is 1 for all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub action_units: Vec<f64>,
    /// Where objects are to go.
    pub aims: Vec<Aim>,
    /// The arm that carries the tool, where it is known. Its joints are the first of the joint positions.
    pub arm: Option<Chain>,
}

/// Entries of a row that belong together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Span {
    /// Short name, e.g. `block`.
    pub name: String,
    /// What it holds.
    pub holds: Holds,
    /// Names of the entries with their units, e.g. `block.x_m`.
    pub entries: Vec<String>,
}

/// What a span holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Holds {
    /// State: the position of each joint that an action drives, in their order \[rad; m of one that slides\].
    JointPositions,
    /// State: their velocities \[rad/s, m/s\].
    JointVelocities,
    /// State: the pose of an object that may move.
    Pose,
    /// State: numbers of which nothing is known.
    Numbers,
    /// State, the same throughout an episode: the pose of a body.
    FixedPose,
    /// State, the same throughout an episode: a point.
    FixedPoint,
    /// Action: velocities of the arm's joints \[rad/s, m/s\].
    ArmVelocities,
    /// Action: velocities of the fingers \[rad/s, m/s\].
    FingerVelocities,
    /// Action: numbers of which nothing is known.
    Commands,
}

/// Where an object is to go: its position comes to that of `target`, moved by `offset_m`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Aim {
    /// Name of the object's span.
    pub object: String,
    /// Name of a span that begins with a position.
    pub target: String,
    /// World frame \[m\].
    pub offset_m: [f64; 3],
}

/// The joints of an arm from its foot to the hand: joint i turns about the z axis of its own frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Chain {
    /// Frames at zero angle, each in that of the joint before; the first in the world's.
    pub joints: Vec<Frame>,
    /// Tool point in the frame of the last joint \[m\].
    pub tool_m: [f64; 3],
}

/// A frame in another.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Frame {
    /// Columns of the rotation matrix.
    pub columns: [[f64; 3]; 3],
    /// Origin \[m\].
    pub origin_m: [f64; 3],
}

impl Holds {
    /// Whether it stays as it is during an episode.
    pub fn is_fixed(self) -> bool {
        matches!(self, Holds::FixedPose | Holds::FixedPoint)
    }

    fn is_of_action(self) -> bool {
        matches!(self, Holds::ArmVelocities | Holds::FingerVelocities | Holds::Commands)
    }

    /// Entries that it must have; `None` when any number will do.
    fn width(self) -> Option<usize> {
        match self {
            Holds::Pose | Holds::FixedPose => Some(POSE_DIM),
            Holds::FixedPoint => Some(POINT_DIM),
            _ => None,
        }
    }
}

impl Layout {
    /// Entries of a state row, D.
    pub fn state_dim(&self) -> usize {
        self.state.iter().map(|span| span.entries.len()).sum()
    }

    /// Entries of an action row.
    pub fn action_dim(&self) -> usize {
        self.action.iter().map(|span| span.entries.len()).sum()
    }

    /// Names of a state's entries, in order.
    pub fn state_entries(&self) -> impl Iterator<Item = &String> {
        self.state.iter().flat_map(|span| &span.entries)
    }

    /// Names of an action's entries, in order.
    pub fn action_entries(&self) -> impl Iterator<Item = &String> {
        self.action.iter().flat_map(|span| &span.entries)
    }

    /// How many entries of a state, from the first, may change during an episode: what a dynamics network predicts.
    pub fn changing(&self) -> usize {
        self.state.iter().filter(|span| !span.holds.is_fixed()).map(|span| span.entries.len()).sum()
    }

    /// How many entries of a state, from the first, are the robot's own: joint positions and velocities. LeRobot has them apart from the rest.
    pub fn proprioception(&self) -> usize {
        self.velocities().end.max(self.positions().end)
    }

    /// The spans of a state with their entries.
    pub fn state_spans(&self) -> impl Iterator<Item = (&Span, Range<usize>)> {
        placed(&self.state)
    }

    /// The entries that hold joint positions; empty when none do.
    pub fn positions(&self) -> Range<usize> {
        first(&self.state, Holds::JointPositions)
    }

    /// The entries that hold joint velocities; empty when none do.
    pub fn velocities(&self) -> Range<usize> {
        first(&self.state, Holds::JointVelocities)
    }

    /// The entries of an action that drive the arm; empty when none are known to.
    pub fn arm(&self) -> Range<usize> {
        first(&self.action, Holds::ArmVelocities)
    }

    /// The entries of an action that drive the fingers; empty when none are known to.
    pub fn fingers(&self) -> Range<usize> {
        first(&self.action, Holds::FingerVelocities)
    }

    /// What counts for entry `i` of an action as a radian a second does, without its sign; `None` for a command of which nothing is known.
    pub fn action_unit(&self, i: usize) -> Option<f32> {
        let holds = placed(&self.action).find(|(_, at)| at.contains(&i)).map(|(span, _)| span.holds);
        (holds != Some(Holds::Commands)).then(|| self.closing_unit(i).abs())
    }

    /// The same with its sign: a command above 0 times it closes a finger.
    pub fn closing_unit(&self, i: usize) -> f32 {
        self.action_units.get(i).map_or(1.0, |unit| *unit as f32)
    }

    /// What counts for entry `i` of a state as a radian, a radian a second or a metre does; `None` for a number of which nothing is known.
    pub fn state_unit(&self, i: usize) -> Option<f32> {
        let (span, at) = self.state_spans().find(|(_, at)| at.contains(&i))?;
        match span.holds {
            Holds::Numbers => None,
            Holds::JointPositions | Holds::JointVelocities => self.action_unit(i - at.start),
            _ => Some(1.0),
        }
    }

    /// Objects that may move, each with its first entry.
    pub fn objects(&self) -> impl Iterator<Item = (&str, usize)> {
        self.state_spans().filter(|(span, _)| span.holds == Holds::Pose).map(|(span, at)| (span.name.as_str(), at.start))
    }

    /// First entries of the object and the target of each aim, and the offset.
    ///
    /// # Panics
    /// With a layout that [`Layout::check`] refuses.
    pub fn aims(&self) -> impl Iterator<Item = (usize, usize, [f64; 3])> {
        let at = |name: &str| self.state_spans().find(|(span, _)| span.name == name).expect("a checked name").1.start;
        self.aims.iter().map(move |aim| (at(&aim.object), at(&aim.target), aim.offset_m))
    }
}

/// Spans with their entries.
fn placed(spans: &[Span]) -> impl Iterator<Item = (&Span, Range<usize>)> {
    spans.iter().scan(0, |from, span| {
        let at = *from..*from + span.entries.len();
        *from = at.end;
        Some((span, at))
    })
}

/// Entries of the span that holds this; empty when there is none.
fn first(spans: &[Span], holds: Holds) -> Range<usize> {
    placed(spans).find(|(span, _)| span.holds == holds).map_or(0..0, |(_, at)| at)
}
