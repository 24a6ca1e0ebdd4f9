//! The demonstrator: follows a plan by where the arm *is*, not by the clock.
//!
//! The reference is the point of the plan that the present state has reached; fingers close, lift and open on conditions of the
//! state. So the action is (up to noise) a function of the state, and a policy without memory can imitate it.

use super::Controller;
use crate::demo::Phase;
use crate::joints::Joints;
use crate::math::cos;
use crate::plan::Plan;
use crate::robot::Robot;
use crate::state::{Action, CONTROL_DT_S, Pose};
use crate::task::Target;
use crate::tasks::Observation;
use nalgebra::{Matrix6, Vector3, Vector6};
use std::sync::Arc;

/// The arm steers towards the plan's point this many samples ahead of the one reached (0.3 s): the feedback gain is 1 / 0.3 s.
const LOOK_AHEAD: usize = 6;
/// Feedback gain on positions \[1/s\].
const GAIN_PER_S: f64 = 1.0 / (LOOK_AHEAD as f64 * CONTROL_DT_S);
/// Samples that the reached point may advance in one step.
const MAX_ADVANCE: usize = 4;
/// Samples that the reached point may fall back in one step.
const MAX_RETREAT: usize = 12;
/// Funnel: lateral error beyond this sets the reached point back \[m\] ...
const FUNNEL_FREE_M: f64 = 0.005;
/// ... by this length of path per length of error ...
const FUNNEL_SLOPE: f64 = 3.0;
/// ... within this distance before the segment's end \[m\].
const FUNNEL_LENGTH_M: f64 = 0.10;
/// Fingers close when the tool is this near to the grasp horizontally \[m\] ...
const CLOSE_XY_M: f64 = 0.006;
/// ... and this little above it \[m\].
const CLOSE_Z_M: f64 = 0.004;
/// Fingers open when the object is this near to its target horizontally \[m\] ...
const OPEN_XY_M: f64 = 0.008;
/// ... and this little above it \[m\].
const OPEN_Z_M: f64 = 0.004;
/// ... or, when it leans in the hand and touches something, this little: a cube of 5 cm that leans by 20 degrees comes no lower than 7 mm \[m\].
const LEANING_Z_M: f64 = 0.008;
/// An object leans in the hand from this angle on \[rad\] (8 degrees): a cube of 5 cm that leans less comes as low as 4 mm.
const LEANING_RAD: f64 = 8.0 * std::f64::consts::PI / 180.0;
/// The way up from a released object ends for the next goal when so little of it is left \[m\]: there is nothing to be exact about.
const RETREATED_M: f64 = 0.02;
/// The grip is firm when the fingers move slower than this share of the speed with which they close.
const STALLED: f64 = 0.1875;
/// The hand is open when every finger is this near to its place in the open hand \[rad, and what counts as one\].
const OPENED_RAD: f64 = 0.02;
/// Damping of the Jacobian's inverse \[m/rad\]: bounds joint speeds near singular poses.
const DAMPING: f64 = 0.02;

/// The samples of one phase with the tool's path.
#[derive(Clone, Debug)]
struct Segment {
    q: Vec<Joints>,
    tool_m: Vec<Vector3<f64>>,
    /// Path length from the segment's start \[m\].
    arc_m: Vec<f64>,
}

impl Segment {
    fn new(plan: &Plan, goal: usize, phase: Phase) -> Option<Self> {
        let robot = &plan.scene.robot;
        let q: Vec<_> = plan.waypoints.iter().filter(|w| (w.goal, w.phase) == (goal, phase)).map(|w| w.q).collect();
        let tool_m: Vec<Vector3<f64>> = q.iter().map(|q| robot.tool_pose(q).translation.vector).collect();
        let mut arc_m = Vec::with_capacity(q.len());
        for (i, p) in tool_m.iter().enumerate() {
            arc_m.push(if i == 0 { 0.0 } else { arc_m[i - 1] + (p - tool_m[i - 1]).norm() });
        }
        (!q.is_empty()).then_some(Segment { q, tool_m, arc_m })
    }

    fn last(&self) -> usize {
        self.q.len() - 1
    }

    /// The sample nearest to `tool_m` within reach of the last one.
    fn project(&self, tool_m: &Vector3<f64>, reached: usize) -> usize {
        let range = reached.saturating_sub(MAX_RETREAT)..=(reached + MAX_ADVANCE).min(self.last());
        let distance = |i: usize| (self.tool_m[i] - tool_m).norm_squared();
        range.min_by(|a, b| distance(*a).total_cmp(&distance(*b))).unwrap_or(reached)
    }

    /// Sets the sample back by the funnel: the nearer the end, the straighter the way there must be.
    fn funnel(&self, reached: usize, tool_m: &Vector3<f64>) -> usize {
        let left = self.arc_m[self.last()] - self.arc_m[reached];
        let lateral = (self.tool_m[reached] - tool_m).xy().norm();
        let back = (FUNNEL_SLOPE * (lateral - FUNNEL_FREE_M).max(0.0)).min((FUNNEL_LENGTH_M - left).max(0.0));
        let arc = self.arc_m[reached] - back;
        self.arc_m.partition_point(|a| *a < arc).min(reached)
    }
}

/// The part of a plan that is for one goal.
#[derive(Clone, Debug)]
struct Course {
    /// The object, by its place in the task.
    object: usize,
    /// How it stands at the start.
    stood: Pose,
    approach: Segment,
    carry: Segment,
    retreat: Option<Segment>,
    /// Object's centre minus tool point at the planned grasp \[m\].
    object_from_tool_m: Vector3<f64>,
    /// Where the object's centre must be to let go \[m\]; `None` when the task holds it.
    release_m: Option<Vector3<f64>>,
    /// Another object that an earlier goal moves, on or in which this one goes, and where the plan has it \[m\].
    support: Option<(usize, Vector3<f64>)>,
}

impl Course {
    fn new(plan: &Plan, goal: usize) -> Option<Self> {
        let scene = &plan.scene;
        let object = scene.task.goals[goal].object;
        let approach = Segment::new(plan, goal, Phase::Approach)?;
        let carry = Segment::new(plan, goal, Phase::Carry)?;
        let retreat = Segment::new(plan, goal, Phase::Retreat);
        let stood = scene.objects[object].pose;
        let object_from_tool_m = Vector3::from(stood.position_m) - carry.tool_m[0];
        let release_m = retreat.is_some().then(|| Vector3::from(scene.target_m(goal)));
        let support = match scene.task.goals[goal].target {
            Target::On(other) | Target::In(other) if scene.task.goal_of(other).is_some() => {
                Some((other, scene.place_after(other, goal).into()))
            }
            _ => None,
        };
        Some(Course { object, stood, approach, carry, retreat, object_from_tool_m, release_m, support })
    }

    /// How far the object's target is from where the plan has it \[m\]: it stands on what was put there just now.
    fn astray_m(&self, seen: &Observation) -> Vector3<f64> {
        self.support.map_or_else(Vector3::zeros, |(other, planned)| Vector3::from(seen.at(other)) - planned)
    }
}

/// Follows one plan.
#[derive(Clone, Debug)]
pub struct Follower {
    robot: Arc<Robot>,
    courses: Vec<Course>,
    goal: usize,
    phase: Phase,
    reached: usize,
}

impl Follower {
    /// A follower at the start of `plan`; `None` if the plan lacks a phase that its task needs.
    pub fn new(plan: &Plan) -> Option<Self> {
        let robot = Arc::clone(&plan.scene.robot);
        let courses = (0..plan.scene.task.goals.len()).map(|goal| Course::new(plan, goal)).collect::<Option<Vec<_>>>()?;
        Some(Follower { robot, courses, goal: 0, phase: Phase::Approach, reached: 0 })
    }

    fn enter(&mut self, phase: Phase) {
        self.phase = phase;
        self.reached = 0;
    }

    /// Moves on to the next phase when the state says so.
    fn switch(&mut self, seen: &Observation) {
        let tool = Vector3::from(seen.tool_m);
        let course = &self.courses[self.goal];
        match self.phase {
            Phase::Approach => {
                let off = tool - course.approach.tool_m[course.approach.last()];
                if off.xy().norm() < CLOSE_XY_M && off.z < CLOSE_Z_M {
                    self.enter(Phase::Close);
                }
            }
            Phase::Close => {
                let stalled = STALLED * self.robot.finger_speed;
                if seen.gripped(course.object) && seen.state.dq[self.robot.arm..].iter().all(|v| v.abs() < stalled) {
                    self.enter(Phase::Carry);
                }
            }
            Phase::Carry => {
                let object = Vector3::from(seen.at(course.object)) - course.astray_m(seen);
                let leans = || seen.objects[course.object].pose.uprightness(&course.stood) < cos(LEANING_RAD);
                let least_m = if seen.touches(course.object) && leans() { LEANING_Z_M } else { OPEN_Z_M };
                if course.release_m.is_some_and(|to| (object - to).xy().norm() < OPEN_XY_M && object.z - to.z < least_m) {
                    self.enter(Phase::Open);
                }
            }
            Phase::Open => {
                if self.is_open(&seen.state.q) {
                    self.enter(Phase::Retreat);
                }
            }
            Phase::Retreat => {
                let left = |retreat: &Segment| retreat.arc_m[retreat.last()] - retreat.arc_m[self.reached];
                let away = course.retreat.as_ref().is_some_and(|retreat| left(retreat) < RETREATED_M);
                if away && self.goal + 1 < self.courses.len() {
                    self.goal += 1;
                    self.enter(Phase::Approach);
                }
            }
        }
    }

    /// Whether every finger is back where it is in the open hand, or beyond.
    fn is_open(&self, q: &Joints) -> bool {
        let robot = &self.robot;
        robot.fingers().enumerate().all(|(i, joint)| {
            let left = (q[joint] - robot.ready[joint]) * robot.closing_way(i).signum();
            left < OPENED_RAD * robot.joints[joint].per_radian()
        })
    }

    /// Command of the arm towards the plan, the tool's target shifted by `shift_m`.
    fn steer(&self, segment: &Segment, from: usize, q: &Joints, shift_m: &Vector3<f64>) -> Joints {
        let ahead = &segment.q[(from + LOOK_AHEAD).min(segment.last())];
        let (_, jacobian) = self.robot.tool_jacobian(q);
        let shift = Vector6::new(shift_m.x, shift_m.y, shift_m.z, 0.0, 0.0, 0.0);
        let mut damped = Matrix6::zeros();
        jacobian.column_iter().for_each(|column| damped.ger(1.0, &column, &column, 1.0));
        damped += Matrix6::identity() * (DAMPING * DAMPING);
        let forces = damped.cholesky().map_or(Vector6::zeros(), |c| c.solve(&shift));
        Joints::from_fn(self.robot.arm, |i| GAIN_PER_S * (ahead[i] - q[i] + jacobian.column(i).dot(&forces)))
    }
}

impl Controller for Follower {
    fn command(&mut self, seen: &Observation) -> Action {
        self.switch(seen);
        let q = &seen.state.q;
        let tool = Vector3::from(seen.tool_m);
        let still = Vector3::zeros();
        let course = &self.courses[self.goal];
        let (arm, reached) = match self.phase {
            Phase::Approach => {
                let reached = course.approach.project(&tool, self.reached);
                let from = course.approach.funnel(reached, &tool);
                (self.steer(&course.approach, from, q, &still), reached)
            }
            Phase::Close => (self.steer(&course.approach, course.approach.last(), q, &still), self.reached),
            Phase::Carry => {
                // Steer the object, not the hand: the grasp is never exactly where it was planned.
                let astray = course.astray_m(seen);
                let virtual_tool = Vector3::from(seen.at(course.object)) - course.object_from_tool_m - astray;
                let reached = course.carry.project(&virtual_tool, self.reached);
                let from = if course.release_m.is_some() { course.carry.funnel(reached, &virtual_tool) } else { reached };
                (self.steer(&course.carry, from, q, &(tool - virtual_tool)), reached)
            }
            Phase::Open => (Joints::zeros(self.robot.arm), self.reached),
            Phase::Retreat => match &course.retreat {
                Some(retreat) => {
                    let reached = retreat.project(&tool, self.reached);
                    (self.steer(retreat, reached, q, &still), reached)
                }
                None => (Joints::zeros(self.robot.arm), self.reached),
            },
        };
        self.reached = reached;
        let robot = &self.robot;
        let finger = |joint: usize| {
            let closing = robot.finger_speed * robot.closing_way(joint - robot.arm).signum();
            match self.phase {
                Phase::Approach | Phase::Retreat => GAIN_PER_S * (robot.ready[joint] - q[joint]),
                Phase::Close | Phase::Carry => closing,
                Phase::Open => -closing,
            }
        };
        Joints::from_fn(q.len(), |i| {
            let command = if i < robot.arm { arm[i] } else { finger(i) };
            robot.joints[i].within_limits(command, q[i], CONTROL_DT_S)
        })
    }

    fn phase(&self) -> Option<Phase> {
        Some(self.phase)
    }
}
