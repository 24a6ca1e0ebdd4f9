//! What can be a layout, and what is a damaged file's.

use super::{Aim, Holds, Layout, MOST_AIMS, MOST_ARM_JOINTS, MOST_ENTRIES, MOST_OBJECTS, Span};
use std::collections::BTreeSet;

/// Longest control period \[s\].
const LONGEST_PERIOD_S: f64 = 10.0;

impl Layout {
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
        let units = &self.action_units;
        if !units.is_empty() && (units.len() != dim || !units.iter().all(|v| v.is_finite() && v.abs() > 0.0)) {
            return Err(format!("{} units of actions of {dim} entries: one for each is needed, or none", units.len()));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::{Chain, Frame, POINT_DIM, POSE_DIM};

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
            action_units: Vec::new(),
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
