//! From a scene to a demonstration: grasp, collision-free path, smooth joint trajectory sampled at the control rate.

use crate::config::PlanSettings;
use crate::demo::Phase;
use crate::scene::Scene;
use crate::state::JOINTS;
use crate::table::Table;
use rand::Rng;

/// One sample of a plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waypoint {
    /// Which part of the plan this is.
    pub phase: Phase,
    /// Joint angles \[rad\].
    pub q_rad: [f64; JOINTS],
    /// Joint velocities \[rad/s\].
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
    /// No joint angles put the open hand around the block, or at the release.
    #[error("grasp: {0}")]
    Grasp(String),
    /// No collision-free way between two hand poses.
    #[error("transit: {0}")]
    Transit(String),
    /// No smooth trajectory within the limits and clear of obstacles.
    #[error("smoothing: {0}")]
    Smoothing(String),
}

/// Makes plans; keeps its arm and its scratch memory between them.
#[derive(Clone, Debug)]
pub struct Planner {
    settings: PlanSettings,
}

impl Planner {
    /// A planner with these settings.
    pub fn new(settings: &PlanSettings) -> Self {
        Planner { settings: settings.clone() }
    }

    /// Plans one demonstration of `scene`; `index` goes into the plan, `rng` is used only where a search is needed.
    ///
    /// # Errors
    /// [`PlanError`]: which stage failed, and why.
    pub fn plan(&mut self, index: u64, scene: &Scene, rng: &mut impl Rng) -> Result<Plan, PlanError> {
        let _ = (index, scene, rng, &self.settings);
        Err(PlanError::Grasp("not yet".into()))
    }
}

/// Plans as a table, one row per waypoint.
pub fn to_table(plans: &[Plan]) -> Table {
    let _ = plans;
    Table::default()
}

/// The inverse of [`to_table`].
///
/// # Errors
/// Says which column is missing or which value is wrong.
pub fn from_table(table: &Table) -> Result<Vec<Plan>, String> {
    let _ = table;
    Ok(Vec::new())
}
