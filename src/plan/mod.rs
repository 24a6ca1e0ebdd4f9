//! From a scene to a demonstration: grasp, collision-free path, smooth joint trajectory sampled at the control rate.
//!
//! Demonstrations have low entropy on purpose: one grasp, one branch of the wrist, straight lines with rounded corners; a search only where
//! something stands in the way.

mod collision;
mod grasp;
mod path;
mod search;
mod smooth;
mod table;
mod timing;
mod transit;
mod world;

pub use grasp::{GRASP_OVER_CENTER_M, LIFTED_CENTER_M, RELEASE_GAP_M};
pub use smooth::Limits;
pub use table::{from_table, to_table};
pub use world::{CLEARANCE_M, RESOLUTION_M};

use crate::config::PlanSettings;
use crate::demo::Phase;
use crate::robot::jaco::PRESHAPE_RAD;
use crate::robot::{Ik, READY_Q_RAD};
use crate::scene::Scene;
use crate::state::{ARM_JOINTS, CONTROL_DT_S, JOINTS};
use grasp::{CARRY_RISE_M, PREGRASP_RISE_M, RETREAT_RISE_M, grasps, raised, ready, releases};
use path::{Knot, tool_pose};
use rand::Rng;
use transit::Leg;
use world::{Block, World};

/// Finger angle of the closed hand in a plan \[rad\]: a 5 cm cube stops the fingers at .98 to 1.01.
pub const CLOSED_RAD: f64 = 0.98;
/// Pieces of the fingers' way, fine enough for its short acceleration.
const FINGER_SAMPLES: usize = 10;

/// One sample of a plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waypoint {
    /// Which part of the plan this is.
    pub phase: Phase,
    /// Joint angles \[rad\].
    pub q_rad: [f64; JOINTS],
    /// Velocity that leads to the next sample in one control step \[rad/s\]; zero on the last sample of each phase, where the arm rests.
    pub dq_rad_s: [f64; JOINTS],
}

/// One planned demonstration, sampled at [`crate::state::CONTROL_HZ`]. Phases come in the order of [`Phase::ALL`]; a pick-up ends with
/// its carry (the lift).
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Episode number.
    pub index: u64,
    /// What stands where.
    pub scene: Scene,
    /// The samples, [`crate::state::CONTROL_DT_S`] apart.
    pub waypoints: Vec<Waypoint>,
}

/// Why a scene has no plan.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// No joint angles put the open hand around the block, or the held block at its target.
    #[error("grasp: {0}")]
    Grasp(String),
    /// No collision-free way between two hand poses.
    #[error("transit: {0}")]
    Transit(String),
    /// No smooth trajectory within the limits and clear of obstacles.
    #[error("smoothing: {0}")]
    Smoothing(String),
}

impl PlanError {
    /// How far the plan had come.
    fn progress(&self) -> u8 {
        match self {
            PlanError::Grasp(_) => 0,
            PlanError::Transit(_) => 1,
            PlanError::Smoothing(_) => 2,
        }
    }
}

/// Makes plans; keeps its arm and its programs between them, which leave no trace in the results.
pub struct Planner {
    settings: PlanSettings,
    limits: Limits,
    ik: Ik,
}

impl Planner {
    /// A planner with these settings.
    pub fn new(settings: &PlanSettings) -> Self {
        Planner { settings: settings.clone(), limits: Limits::new(settings), ik: Ik::new() }
    }

    /// Plans one demonstration of `scene`; `index` goes into the plan, `rng` is used only where a search is needed.
    ///
    /// # Errors
    /// [`PlanError`]: which stage failed, and why; of several grasps, the one that came farthest.
    pub fn plan(&mut self, index: u64, scene: &Scene, rng: &mut impl Rng) -> Result<Plan, PlanError> {
        let world = World::new(scene);
        let mut farthest: Option<PlanError> = None;
        let mut keep = |error: PlanError| {
            if farthest.as_ref().is_none_or(|f| error.progress() > f.progress()) {
                farthest = Some(error);
            }
        };
        for grasp in grasps(scene) {
            let approach = match self.approach(scene, &world, &grasp, rng) {
                Ok(approach) => approach,
                Err(error) => {
                    keep(error);
                    continue;
                }
            };
            let ends = releases(scene, &grasp);
            let rests = if ends.is_empty() { vec![None] } else { ends.into_iter().map(Some).collect() };
            for release in rests {
                match self.after_grasp(scene, &world, &grasp, release, approach.clone(), rng) {
                    Ok(pieces) => return Ok(Plan { index, scene: scene.clone(), waypoints: waypoints(&pieces) }),
                    Err(error) => keep(error),
                }
            }
        }
        Err(farthest.expect("there is at least one grasp candidate"))
    }

    /// From the ready pose down to the grasp.
    fn approach(&mut self, scene: &Scene, world: &World, grasp: &Knot, rng: &mut impl Rng) -> Result<Vec<Piece>, PlanError> {
        let block = Block::Free(scene.block.isometry());
        let above = raised(grasp, PREGRASP_RISE_M);
        let q_above = self.reach(&above, &READY_Q_RAD, "above the block")?;
        let q = self.reach(grasp, &q_above, "at the block")?;
        world
            .check(&q, &block, CLEARANCE_M)
            .map_err(|why| PlanError::Grasp(format!("with the open hand around the block, {why}")))?;
        let leg = Leg {
            phase: Phase::Approach,
            before: Vec::new(),
            from: ready(),
            to: above,
            after: vec![*grasp],
            block,
            start: READY_Q_RAD,
        };
        let q = self.transit(world, &leg, rng)?;
        let closing = self.fingers(Phase::Close, q[q.len() - 1], CLOSED_RAD)?;
        Ok(vec![Piece { phase: Phase::Approach, q }, closing])
    }

    /// From the closed hand to the end: lift, or carry, release and retreat.
    fn after_grasp(
        &mut self,
        scene: &Scene,
        world: &World,
        grasp: &Knot,
        release: Option<Knot>,
        mut pieces: Vec<Piece>,
        rng: &mut impl Rng,
    ) -> Result<Vec<Piece>, PlanError> {
        let in_tool = tool_pose(grasp).inv_mul(&scene.block.isometry());
        let (block, start) = (Block::Held(in_tool), end_of(&pieces));
        let Some(release) = release else {
            let lifted = raised(grasp, LIFTED_CENTER_M - scene.block.position_m[2]);
            let leg = Leg { phase: Phase::Carry, before: Vec::new(), from: *grasp, to: lifted, after: Vec::new(), block, start };
            pieces.push(Piece { phase: Phase::Carry, q: self.transit(world, &leg, rng)? });
            return Ok(pieces);
        };
        let height = grasp.z.max(release.z) + CARRY_RISE_M;
        let (lifted, above) = (raised(grasp, height - grasp.z), raised(&release, height - release.z));
        let q_above = self.reach(&above, &start, "above the target")?;
        let q = self.reach(&release, &q_above, "at the target")?;
        world.check(&q, &block, CLEARANCE_M).map_err(|why| PlanError::Grasp(format!("with the block at its target, {why}")))?;
        let leg = Leg { phase: Phase::Carry, before: vec![*grasp], from: lifted, to: above, after: vec![release], block, start };
        pieces.push(Piece { phase: Phase::Carry, q: self.transit(world, &leg, rng)? });
        pieces.push(self.fingers(Phase::Open, end_of(&pieces), PRESHAPE_RAD)?);
        let block = Block::Free(tool_pose(&release) * in_tool);
        let up = raised(&release, RETREAT_RISE_M);
        let leg = Leg {
            phase: Phase::Retreat,
            before: Vec::new(),
            from: release,
            to: up,
            after: Vec::new(),
            block,
            start: end_of(&pieces),
        };
        pieces.push(Piece { phase: Phase::Retreat, q: self.transit(world, &leg, rng)? });
        Ok(pieces)
    }

    /// Joint angles at a hand pose, by way of `seed`.
    fn reach(&mut self, knot: &Knot, seed: &[f64; JOINTS], place: &str) -> Result<[f64; JOINTS], PlanError> {
        self.ik.solve(&tool_pose(knot), seed).map_err(|why| {
            PlanError::Grasp(format!(
                "the level hand cannot reach {place}: {why}; it reaches 0.28 m to 0.68 m around the base, set the spawn area \
                 (scene.spawn_x_m, scene.spawn_y_m) and scene.base_xy_m within"
            ))
        })
    }

    /// Fingers from where they are to `angle_rad`, the arm still.
    fn fingers(&self, phase: Phase, start: [f64; JOINTS], angle_rad: f64) -> Result<Piece, PlanError> {
        let path: Vec<[f64; JOINTS]> = (0..=FINGER_SAMPLES)
            .map(|k| {
                let share = k as f64 / FINGER_SAMPLES as f64;
                std::array::from_fn(|j| if j < ARM_JOINTS { start[j] } else { start[j] + share * (angle_rad - start[j]) })
            })
            .collect();
        let q = self.smooth_path(&path).map_err(PlanError::Smoothing)?;
        Ok(Piece { phase, q })
    }
}

/// The samples of one phase, both ends included.
#[derive(Clone, Debug)]
struct Piece {
    phase: Phase,
    q: Vec<[f64; JOINTS]>,
}

/// Where the last piece ends.
fn end_of(pieces: &[Piece]) -> [f64; JOINTS] {
    let q = &pieces[pieces.len() - 1].q;
    q[q.len() - 1]
}

/// The pieces one after another; each but the first leaves out the sample it begins with, the last of the one before.
fn waypoints(pieces: &[Piece]) -> Vec<Waypoint> {
    let mut waypoints = Vec::new();
    for (number, piece) in pieces.iter().enumerate() {
        for (k, q) in piece.q.iter().enumerate().skip(usize::from(number > 0)) {
            let next = piece.q.get(k + 1).unwrap_or(q);
            let dq_rad_s = std::array::from_fn(|j| (next[j] - q[j]) / CONTROL_DT_S);
            waypoints.push(Waypoint { phase: piece.phase, q_rad: *q, dq_rad_s });
        }
    }
    waypoints
}
