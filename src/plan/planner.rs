//! The planner: one attempt after another, each a grasp, its approach, and what follows.

use super::grasp::{CARRY_RISE_M, PREGRASP_RISE_M, RETREAT_RISE_M, closed_around, grasps, lift_m, raised, ready, releases};
use super::path::{Knot, tool_pose};
use super::smooth::Limits;
use super::transit::{Leg, Motions, smooth_path};
use super::world::{Moved, PATH_CLEARANCES_M, World};
use super::{Plan, PlanError, Waypoint};
use crate::config::PlanSettings;
use crate::demo::Phase;
use crate::interrupt::Interrupt;
use crate::joints::Joints;
use crate::robot::{Ik, Robot};
use crate::scene::Scene;
use crate::state::CONTROL_DT_S;
use crate::task::{Object, Task};
use nalgebra::Isometry3;
use rand::Rng;
use std::sync::Arc;

/// Pieces of the fingers' way, fine enough for its short acceleration.
const FINGER_SAMPLES: usize = 10;

/// Makes plans; keeps its arm and its programs between them, which leave no trace in the results.
pub struct Planner {
    motions: Motions,
    /// For each object that the task moves, see [`closing`].
    closing: Vec<Vec<Joints>>,
}

impl Planner {
    /// A planner for this robot in this task with these settings.
    pub fn new(robot: &Arc<Robot>, task: &Task, settings: &PlanSettings) -> Self {
        let limits = Limits::new(robot, settings);
        let interrupt = Interrupt::default();
        let closing = task.objects[..task.moved()].iter().map(|object| closing(robot, object, &limits, &interrupt)).collect();
        let (robot, ik) = (Arc::clone(robot), Ik::new(robot));
        Planner { motions: Motions { robot, settings: settings.clone(), limits, ik, interrupt }, closing }
    }

    /// Lets Ctrl-C end the planning of a scene: a plan that was on its way is an error then.
    pub fn with_interrupt(self, interrupt: &Interrupt) -> Self {
        Planner { motions: Motions { interrupt: interrupt.clone(), ..self.motions }, ..self }
    }

    /// Plans one demonstration of `scene`, one of the planner's task; `index` goes into the plan, `rng` is used only where a search is needed.
    ///
    /// # Errors
    /// [`PlanError`]: which stage failed, and why; of several grasps, the one that came farthest, and of those the preferred one.
    pub fn plan(&mut self, index: u64, scene: &Scene, rng: &mut impl Rng) -> Result<Plan, PlanError> {
        let mut pieces = Vec::new();
        let (mut at, mut from) = (ready(&self.motions.robot), self.motions.robot.ready);
        for goal in 0..scene.task.goals.len() {
            let world = World::new(scene, goal);
            let (of_goal, end) = self.reach_goal(&world, (at, from), rng)?;
            from = end_of(&of_goal);
            at = end;
            pieces.extend(of_goal.into_iter().map(|piece| (goal, piece)));
        }
        Ok(Plan { index, scene: scene.clone(), waypoints: waypoints(&pieces) })
    }

    /// The pieces for one goal, from the hand's pose and the joint angles at the end of those before, and where the hand is then.
    fn reach_goal(
        &mut self,
        world: &World,
        (from, start): (Knot, Joints),
        rng: &mut impl Rng,
    ) -> Result<(Vec<Piece>, Knot), PlanError> {
        let mut farthest: Option<PlanError> = None;
        for margin_m in PATH_CLEARANCES_M {
            for grasp in grasps(world.scene, world.goal) {
                match self.with_grasp(&Try { world, from, start, grasp, margin_m }, rng) {
                    Ok(found) => return Ok(found),
                    Err(error) if farthest.as_ref().is_none_or(|f| error.progress() > f.progress()) => farthest = Some(error),
                    Err(_) => {}
                }
                if self.motions.interrupt.is_raised() {
                    return Err(PlanError::Transit("interrupted".into()));
                }
            }
            if !world.has_obstacles() {
                break;
            }
        }
        Err(farthest.expect("there is at least one grasp candidate"))
    }

    /// The whole way to a goal with one grasp and the first release that works.
    fn with_grasp(&mut self, with: &Try, rng: &mut impl Rng) -> Result<(Vec<Piece>, Knot), PlanError> {
        let (scene, goal) = (with.world.scene, with.world.goal);
        let approach = self.approach(with, rng)?;
        if !scene.task.goals[goal].kind().releases() {
            let lifted = raised(&with.grasp, lift_m(scene, goal));
            return Ok((self.lift(with, lifted, approach, rng)?, lifted));
        }
        let mut first = None;
        for release in releases(scene, goal, &with.grasp) {
            match self.carry(with, &release, approach.clone(), rng) {
                Ok(pieces) => return Ok((pieces, raised(&release, RETREAT_RISE_M))),
                Err(error) => first = first.or(Some(error)),
            }
        }
        Err(first.expect("there is at least one release candidate"))
    }

    /// From where the hand is down to the grasp, and the fingers closed.
    fn approach(&mut self, with: &Try, rng: &mut impl Rng) -> Result<Vec<Piece>, PlanError> {
        let (standing, grasp) = (Moved::Free(with.pose()), with.grasp);
        let above = raised(&grasp, PREGRASP_RISE_M);
        let name = &with.world.object().name;
        let q_above = self.motions.reach(&above, &with.start, &format!("above the {name}"))?;
        let q = self.motions.reach(&grasp, &q_above, &format!("at the {name}"))?;
        with.world
            .check(&q, &standing, with.margin_m)
            .map_err(|why| PlanError::Grasp(format!("with the open hand around the {name}, {why}")))?;
        let leg = Leg {
            phase: Phase::Approach,
            before: Vec::new(),
            from: with.from,
            to: above,
            after: vec![grasp],
            moved: standing,
            margin_m: with.margin_m,
            start: with.start,
        };
        let q = self.motions.transit(with.world, &leg, rng)?;
        let closing = self.fingers(Phase::Close, self.closing[with.world.number()].iter(), &q[q.len() - 1]);
        Ok(vec![Piece { phase: Phase::Approach, q }, closing])
    }

    /// Straight up with the object.
    fn lift(&mut self, with: &Try, lifted: Knot, mut pieces: Vec<Piece>, rng: &mut impl Rng) -> Result<Vec<Piece>, PlanError> {
        let leg = with.straight_up(Phase::Carry, with.grasp, lifted, Moved::Held(with.in_tool()), end_of(&pieces));
        pieces.push(Piece { phase: Phase::Carry, q: self.motions.transit(with.world, &leg, rng)? });
        Ok(pieces)
    }

    /// Lift, move and lower; the fingers opened, and straight up.
    fn carry(&mut self, with: &Try, release: &Knot, mut pieces: Vec<Piece>, rng: &mut impl Rng) -> Result<Vec<Piece>, PlanError> {
        let (held, start, grasp) = (Moved::Held(with.in_tool()), end_of(&pieces), with.grasp);
        let height = grasp.z.max(release.z) + CARRY_RISE_M;
        let (from, to) = (raised(&grasp, height - grasp.z), raised(release, height - release.z));
        let q_above = self.motions.reach(&to, &start, "above the target")?;
        let mut q = self.motions.reach(release, &q_above, "at the target")?;
        let placed = Moved::Free(tool_pose(release) * with.in_tool());
        let name = &with.world.object().name;
        let at_target = |why| PlanError::Grasp(format!("with the {name} at its target, {why}"));
        with.world.check(&q, &held, with.margin_m).map_err(at_target)?;
        let robot = &self.motions.robot;
        q[robot.arm..].copy_from_slice(&robot.ready[robot.arm..]);
        with.world.check(&q, &placed, with.margin_m).map_err(at_target)?;
        let (before, after) = (vec![grasp], vec![*release]);
        let leg = Leg { phase: Phase::Carry, before, from, to, after, moved: held, margin_m: with.margin_m, start };
        pieces.push(Piece { phase: Phase::Carry, q: self.motions.transit(with.world, &leg, rng)? });
        pieces.push(self.fingers(Phase::Open, self.closing[with.world.number()].iter().rev(), &end_of(&pieces)));
        let leg = with.straight_up(Phase::Retreat, *release, raised(release, RETREAT_RISE_M), placed, end_of(&pieces));
        pieces.push(Piece { phase: Phase::Retreat, q: self.motions.transit(with.world, &leg, rng)? });
        Ok(pieces)
    }

    /// The fingers as in `samples`, the arm still.
    fn fingers<'a>(&self, phase: Phase, samples: impl Iterator<Item = &'a Joints>, arm: &Joints) -> Piece {
        let joints = self.motions.robot.arm;
        let at = |sample: &Joints| Joints::from_fn(sample.len(), |j| if j < joints { arm[j] } else { sample[j] });
        Piece { phase, q: samples.map(at).collect() }
    }
}

/// The hand that closes around an object, from open, in the ready pose, at the control rate; backwards, it opens.
fn closing(robot: &Robot, object: &Object, limits: &Limits, interrupt: &Interrupt) -> Vec<Joints> {
    let (open, closed) = (robot.ready, closed_around(robot, object));
    let at = |k: usize| Joints::from_fn(open.len(), |j| open[j] + (closed[j] - open[j]) * k as f64 / FINGER_SAMPLES as f64);
    let path: Vec<Joints> = (0..=FINGER_SAMPLES).map(at).collect();
    // Where even that fails, the fingers jump in the plan; the follower drives them by speed in any case.
    smooth_path(&path, limits, interrupt).unwrap_or(vec![open, closed])
}

/// One attempt at a goal: where the hand comes from, a grasp, and the distance to keep.
struct Try<'a> {
    world: &'a World<'a>,
    from: Knot,
    start: Joints,
    grasp: Knot,
    margin_m: f64,
}

impl Try<'_> {
    /// Where the object stands.
    fn pose(&self) -> Isometry3<f64> {
        self.world.scene.objects[self.world.number()].pose.isometry()
    }

    /// The held object's pose relative to the tool.
    fn in_tool(&self) -> Isometry3<f64> {
        tool_pose(&self.grasp).inv_mul(&self.pose())
    }

    /// A straight motion with nothing fixed before or behind it.
    fn straight_up(&self, phase: Phase, from: Knot, to: Knot, moved: Moved, start: Joints) -> Leg {
        Leg { phase, before: Vec::new(), from, to, after: Vec::new(), moved, margin_m: self.margin_m, start }
    }
}

/// The samples of one phase, both ends included.
#[derive(Clone, Debug)]
struct Piece {
    phase: Phase,
    q: Vec<Joints>,
}

/// Where the last piece ends.
fn end_of(pieces: &[Piece]) -> Joints {
    let q = &pieces[pieces.len() - 1].q;
    q[q.len() - 1]
}

/// The pieces one after another, each with its goal; each but the first leaves out the sample it begins with, the last of the one before.
fn waypoints(pieces: &[(usize, Piece)]) -> Vec<Waypoint> {
    let mut waypoints = Vec::new();
    for (number, (goal, piece)) in pieces.iter().enumerate() {
        for (k, q) in piece.q.iter().enumerate().skip(usize::from(number > 0)) {
            let next = piece.q.get(k + 1).unwrap_or(q);
            let dq = Joints::from_fn(q.len(), |j| (next[j] - q[j]) / CONTROL_DT_S);
            waypoints.push(Waypoint { goal: *goal, phase: piece.phase, q: *q, dq });
        }
    }
    waypoints
}
