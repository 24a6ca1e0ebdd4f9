//! The planner: one attempt after another, each a grasp, its approach, and what follows.

use super::grasp::{
    CARRY_RISE_M, LIFTED_CENTER_M, PREGRASP_RISE_M, RETREAT_RISE_M, closed_on_block, grasps, raised, ready, releases,
};
use super::path::{Knot, tool_pose};
use super::smooth::Limits;
use super::transit::{Leg, Motions, smooth_path};
use super::world::{Block, PATH_CLEARANCES_M, World};
use super::{Plan, PlanError, Waypoint};
use crate::config::PlanSettings;
use crate::demo::Phase;
use crate::interrupt::Interrupt;
use crate::joints::Joints;
use crate::robot::{Ik, Robot};
use crate::scene::Scene;
use crate::state::{CONTROL_DT_S, Context};
use nalgebra::Isometry3;
use rand::Rng;
use std::sync::Arc;

/// Pieces of the fingers' way, fine enough for its short acceleration.
const FINGER_SAMPLES: usize = 10;

/// Makes plans; keeps its arm and its programs between them, which leave no trace in the results.
pub struct Planner {
    motions: Motions,
    /// See [`closing`].
    closing: Vec<Joints>,
}

impl Planner {
    /// A planner for this robot with these settings.
    pub fn new(robot: &Arc<Robot>, settings: &PlanSettings) -> Self {
        let limits = Limits::new(robot, settings);
        let interrupt = Interrupt::default();
        let closing = closing(robot, &limits, &interrupt);
        let (robot, ik) = (Arc::clone(robot), Ik::new(robot));
        Planner { motions: Motions { robot, settings: settings.clone(), limits, ik, interrupt }, closing }
    }

    /// Lets Ctrl-C end the planning of a scene: a plan that was on its way is an error then.
    pub fn with_interrupt(self, interrupt: &Interrupt) -> Self {
        Planner { motions: Motions { interrupt: interrupt.clone(), ..self.motions }, ..self }
    }

    /// Plans one demonstration of `scene`; `index` goes into the plan, `rng` is used only where a search is needed.
    ///
    /// # Errors
    /// [`PlanError`]: which stage failed, and why; of several grasps, the one that came farthest, and of those the preferred one.
    pub fn plan(&mut self, index: u64, scene: &Scene, rng: &mut impl Rng) -> Result<Plan, PlanError> {
        let world = World::new(scene);
        let mut farthest: Option<PlanError> = None;
        for margin_m in PATH_CLEARANCES_M {
            for grasp in grasps(scene) {
                match self.with_grasp(&Try { scene, world: &world, grasp, margin_m }, rng) {
                    Ok(pieces) => return Ok(Plan { index, scene: scene.clone(), waypoints: waypoints(&pieces) }),
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

    /// The whole plan with one grasp and the first release that works.
    fn with_grasp(&mut self, with: &Try, rng: &mut impl Rng) -> Result<Vec<Piece>, PlanError> {
        let approach = self.approach(with, rng)?;
        if with.scene.context == Context::None {
            return self.lift(with, approach, rng);
        }
        let mut first = None;
        for release in releases(with.scene, &with.grasp) {
            match self.carry(with, &release, approach.clone(), rng) {
                Ok(pieces) => return Ok(pieces),
                Err(error) => first = first.or(Some(error)),
            }
        }
        Err(first.expect("there is at least one release candidate"))
    }

    /// From the ready pose down to the grasp, and the fingers closed.
    fn approach(&mut self, with: &Try, rng: &mut impl Rng) -> Result<Vec<Piece>, PlanError> {
        let (block, grasp) = (Block::Free(with.scene.block.isometry()), with.grasp);
        let above = raised(&grasp, PREGRASP_RISE_M);
        let start = self.motions.robot.ready;
        let q_above = self.motions.reach(&above, &start, "above the block")?;
        let q = self.motions.reach(&grasp, &q_above, "at the block")?;
        with.world
            .check(&q, &block, with.margin_m)
            .map_err(|why| PlanError::Grasp(format!("with the open hand around the block, {why}")))?;
        let from = ready(&self.motions.robot);
        let leg = Leg {
            phase: Phase::Approach,
            before: Vec::new(),
            from,
            to: above,
            after: vec![grasp],
            block,
            margin_m: with.margin_m,
            start,
        };
        let q = self.motions.transit(with.world, &leg, rng)?;
        let closing = self.fingers(Phase::Close, self.closing.iter(), &q[q.len() - 1]);
        Ok(vec![Piece { phase: Phase::Approach, q }, closing])
    }

    /// Straight up with the block.
    fn lift(&mut self, with: &Try, mut pieces: Vec<Piece>, rng: &mut impl Rng) -> Result<Vec<Piece>, PlanError> {
        let lifted = raised(&with.grasp, LIFTED_CENTER_M - with.scene.block.position_m[2]);
        let leg = with.straight_up(Phase::Carry, with.grasp, lifted, Block::Held(with.in_tool()), end_of(&pieces));
        pieces.push(Piece { phase: Phase::Carry, q: self.motions.transit(with.world, &leg, rng)? });
        Ok(pieces)
    }

    /// Lift, move and lower; the fingers opened, and straight up.
    fn carry(&mut self, with: &Try, release: &Knot, mut pieces: Vec<Piece>, rng: &mut impl Rng) -> Result<Vec<Piece>, PlanError> {
        let (block, start, grasp) = (Block::Held(with.in_tool()), end_of(&pieces), with.grasp);
        let height = grasp.z.max(release.z) + CARRY_RISE_M;
        let (from, to) = (raised(&grasp, height - grasp.z), raised(release, height - release.z));
        let q_above = self.motions.reach(&to, &start, "above the target")?;
        let mut q = self.motions.reach(release, &q_above, "at the target")?;
        let placed = Block::Free(tool_pose(release) * with.in_tool());
        let at_target = |why| PlanError::Grasp(format!("with the block at its target, {why}"));
        with.world.check(&q, &block, with.margin_m).map_err(at_target)?;
        let robot = &self.motions.robot;
        q[robot.arm..].copy_from_slice(&robot.ready[robot.arm..]);
        with.world.check(&q, &placed, with.margin_m).map_err(at_target)?;
        let (before, after) = (vec![grasp], vec![*release]);
        let leg = Leg { phase: Phase::Carry, before, from, to, after, block, margin_m: with.margin_m, start };
        pieces.push(Piece { phase: Phase::Carry, q: self.motions.transit(with.world, &leg, rng)? });
        pieces.push(self.fingers(Phase::Open, self.closing.iter().rev(), &end_of(&pieces)));
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

/// The hand that closes around a block, from open, in the ready pose, at the control rate; backwards, it opens.
fn closing(robot: &Robot, limits: &Limits, interrupt: &Interrupt) -> Vec<Joints> {
    let (open, closed) = (robot.ready, closed_on_block(robot));
    let at = |k: usize| Joints::from_fn(open.len(), |j| open[j] + (closed[j] - open[j]) * k as f64 / FINGER_SAMPLES as f64);
    let path: Vec<Joints> = (0..=FINGER_SAMPLES).map(at).collect();
    // Where even that fails, the fingers jump in the plan; the follower drives them by speed in any case.
    smooth_path(&path, limits, interrupt).unwrap_or(vec![open, closed])
}

/// One attempt: a scene, a grasp, and the distance to keep.
struct Try<'a> {
    scene: &'a Scene,
    world: &'a World,
    grasp: Knot,
    margin_m: f64,
}

impl Try<'_> {
    /// The held block's pose relative to the tool.
    fn in_tool(&self) -> Isometry3<f64> {
        tool_pose(&self.grasp).inv_mul(&self.scene.block.isometry())
    }

    /// A straight motion with nothing fixed before or behind it.
    fn straight_up(&self, phase: Phase, from: Knot, to: Knot, block: Block, start: Joints) -> Leg {
        Leg { phase, before: Vec::new(), from, to, after: Vec::new(), block, margin_m: self.margin_m, start }
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

/// The pieces one after another; each but the first leaves out the sample it begins with, the last of the one before.
fn waypoints(pieces: &[Piece]) -> Vec<Waypoint> {
    let mut waypoints = Vec::new();
    for (number, piece) in pieces.iter().enumerate() {
        for (k, q) in piece.q.iter().enumerate().skip(usize::from(number > 0)) {
            let next = piece.q.get(k + 1).unwrap_or(q);
            let dq = Joints::from_fn(q.len(), |j| (next[j] - q[j]) / CONTROL_DT_S);
            waypoints.push(Waypoint { phase: piece.phase, q: *q, dq });
        }
    }
    waypoints
}
