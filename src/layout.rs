//! What the entries of a state row and of an action row mean: named spans, units, control period, and the kinematics behind them. What is
//! recorded, learned and run carries a layout; nothing in learning knows more about robots and tasks than it says.

use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
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
/// Longest control period \[s\].
const LONGEST_PERIOD_S: f64 = 10.0;

/// The layout of the rows of one task, or of one dataset.
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
    /// State: the angle of each joint that an action drives, in their order \[rad\].
    JointPositions,
    /// State: their velocities \[rad/s\].
    JointVelocities,
    /// State: the pose of an object that may move.
    Pose,
    /// State: numbers of which nothing is known.
    Numbers,
    /// State, the same throughout an episode: the pose of a body.
    FixedPose,
    /// State, the same throughout an episode: a point.
    FixedPoint,
    /// Action: velocities of the arm's joints \[rad/s\].
    ArmVelocities,
    /// Action: velocities of the fingers \[rad/s\].
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

    /// How many entries of a state, from the first, may change during an episode: what a dynamics network predicts.
    pub fn changing(&self) -> usize {
        self.state.iter().filter(|span| !span.holds.is_fixed()).map(|span| span.entries.len()).sum()
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

    /// Refuses what cannot be a layout: for one that comes from a file.
    ///
    /// # Errors
    /// Says what does not fit and what is allowed.
    pub fn check(&self) -> Result<(), String> {
        self.check_spans()?;
        let (joints, dim) = (self.positions().len(), self.action_dim());
        for (what, n) in [("joint positions", joints), ("joint velocities", self.velocities().len())] {
            if n != 0 && n != dim {
                return Err(format!(
                    "the layout has {n} {what}, but actions of {dim} entries: one a driven joint is needed, or none"
                ));
            }
        }
        if !(self.period_s > 0.0 && self.period_s <= LONGEST_PERIOD_S) {
            return Err(format!("a control period of {} s; allowed: above 0, at most {LONGEST_PERIOD_S}", self.period_s));
        }
        let limits = &self.action_limits;
        if !limits.is_empty() && (limits.len() != dim || !limits.iter().all(|v| *v > 0.0 && v.is_finite())) {
            return Err(format!("{} limits of actions of {dim} entries: one above 0 for each is needed, or none", limits.len()));
        }
        self.check_arm()?;
        self.check_aims()
    }

    fn check_spans(&self) -> Result<(), String> {
        for (row, spans, dim) in [("state", &self.state, self.state_dim()), ("action", &self.action, self.action_dim())] {
            if !(1..=MOST_ENTRIES).contains(&dim) {
                return Err(format!("{row} rows of {dim} entries; allowed: 1 to {MOST_ENTRIES}"));
            }
            let (mut seen, mut fixed) = (BTreeSet::new(), false);
            for span in spans {
                let (name, n) = (&span.name, span.entries.len());
                if span.holds.is_of_action() != (row == "action") {
                    return Err(format!("span \"{name}\" of the {row} holds what a {row} has not: {:?}", span.holds));
                }
                if span.holds.width().is_some_and(|width| width != n) {
                    return Err(format!("span \"{name}\" has {n} entries, but holds {:?}", span.holds));
                }
                if fixed && !span.holds.is_fixed() {
                    return Err(format!("span \"{name}\" may change, but comes after one that stays; those come last"));
                }
                fixed |= span.holds.is_fixed();
                if !seen.insert(name) {
                    return Err(format!("two spans of the {row} are called \"{name}\""));
                }
            }
        }
        let kinds = [Holds::JointPositions, Holds::JointVelocities, Holds::ArmVelocities, Holds::FingerVelocities];
        let count = |kind| self.state.iter().chain(&self.action).filter(|span| span.holds == kind).count();
        match kinds.into_iter().find(|kind| count(*kind) > 1) {
            Some(kind) => Err(format!("{} spans hold {kind:?}; at most one may", count(kind))),
            None if self.changing() == 0 => Err("no entry of the state may change".into()),
            None => Ok(()),
        }
    }

    fn check_arm(&self) -> Result<(), String> {
        let Some(arm) = &self.arm else { return Ok(()) };
        let (n, known) = (arm.joints.len(), self.arm());
        if !(1..=MOST_ARM_JOINTS).contains(&n) || known != (0..n) || self.positions().start != 0 || self.positions().is_empty() {
            return Err(format!(
                "an arm of {n} joints: allowed are 1 to {MOST_ARM_JOINTS}, which are the first joint positions and the first entries of an \
                 action"
            ));
        }
        let numbers = arm.joints.iter().flat_map(|frame| frame.columns.iter().flatten().chain(&frame.origin_m));
        if !numbers.chain(&arm.tool_m).all(|v| v.is_finite()) {
            return Err("the arm's frames hold a number that is not finite".into());
        }
        Ok(())
    }

    fn check_aims(&self) -> Result<(), String> {
        let objects = self.objects().count();
        if objects > MOST_OBJECTS || self.aims.len() > MOST_AIMS {
            let aims = self.aims.len();
            return Err(format!("{objects} objects with {aims} aims; allowed: {MOST_OBJECTS} objects, {MOST_AIMS} aims"));
        }
        for Aim { object, target, offset_m } in &self.aims {
            if !self.objects().any(|(name, _)| name == object) {
                return Err(format!("an aim is for \"{object}\", but no span of that name holds the pose of an object"));
            }
            let has_position = |span: &Span| matches!(span.holds, Holds::Pose | Holds::FixedPose | Holds::FixedPoint);
            if target == object || !self.state.iter().any(|span| span.name == *target && has_position(span)) {
                return Err(format!("\"{object}\" is to go to \"{target}\", but no other span of that name has a position"));
            }
            if !offset_m.iter().all(|v| v.is_finite()) {
                return Err(format!("the aim of \"{object}\" has an offset that is not finite"));
            }
        }
        Ok(())
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

#[cfg(test)]
mod tests {
    use super::*;

    fn span(name: &str, holds: Holds, n: usize) -> Span {
        Span { name: name.into(), holds, entries: (0..n).map(|i| format!("{name}.{i}")).collect() }
    }

    /// A planar arm of two joints with one finger and a block that goes to a point.
    fn planar() -> Layout {
        let still = Frame { columns: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], origin_m: [0.3, 0.0, 0.0] };
        Layout {
            name: "reach".into(),
            period_s: 0.02,
            state: vec![
                span("q", Holds::JointPositions, 3),
                span("block", Holds::Pose, POSE_DIM),
                span("goal", Holds::FixedPoint, POINT_DIM),
            ],
            action: vec![span("arm", Holds::ArmVelocities, 2), span("finger", Holds::FingerVelocities, 1)],
            action_limits: vec![1.0; 3],
            aims: vec![Aim { object: "block".into(), target: "goal".into(), offset_m: [0.0; 3] }],
            arm: Some(Chain { joints: vec![still; 2], tool_m: [0.0; 3] }),
        }
    }

    #[test]
    fn entries_are_found_by_what_they_hold() {
        let layout = planar();
        assert_eq!(layout.check(), Ok(()));
        assert_eq!((layout.state_dim(), layout.changing(), layout.action_dim()), (13, 10, 3));
        assert_eq!((layout.positions(), layout.velocities(), layout.arm(), layout.fingers()), (0..3, 0..0, 0..2, 2..3));
        assert_eq!(layout.objects().collect::<Vec<_>>(), [("block", 3)]);
        assert_eq!(layout.aims().collect::<Vec<_>>(), [(3, 10, [0.0; 3])]);
        let text = serde_json::to_string(&layout).expect("plain data");
        assert_eq!(serde_json::from_str::<Layout>(&text).expect("the same"), layout);
    }

    #[test]
    fn what_cannot_be_is_refused() {
        type Spoil = fn(&mut Layout);
        let spoilt: [(Spoil, &str); 12] = [
            (|l| l.state.swap(1, 2), "\"block\" may change, but comes after"),
            (|l| l.state[1].name = "goal".into(), "two spans of the state are called \"goal\""),
            (|l| l.state[1].entries.truncate(6), "\"block\" has 6 entries"),
            (|l| l.state[0].holds = Holds::Commands, "holds what a state has not"),
            (|l| l.state.clear(), "state rows of 0 entries"),
            (|l| l.state[0].entries.push("more".into()), "4 joint positions, but actions of 3"),
            (|l| l.period_s = 0.0, "period of 0 s"),
            (|l| l.action_limits = vec![1.0, f64::NAN, 1.0], "limits of actions"),
            (|l| l.action_limits.truncate(1), "1 limits of actions of 3"),
            (|l| l.aims[0].object = "cup".into(), "an aim is for \"cup\""),
            (|l| l.aims[0].target = "block".into(), "to go to \"block\""),
            (|l| l.arm.as_mut().expect("an arm").joints.truncate(1), "an arm of 1 joints"),
        ];
        for (spoil, said) in spoilt {
            let mut layout = planar();
            spoil(&mut layout);
            let why = layout.check().expect_err(said);
            assert!(why.contains(said), "{why}");
        }
    }
}
