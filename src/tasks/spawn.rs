//! Randomisation: where block, goal and base stand.

use super::Task;
use super::pick_and_place::MIN_TRAVEL_M;
use crate::config::SceneSettings;
use crate::error::{Error, Result};
use crate::scene::{BLOCK_EDGE_M, Obstacle, Scene};
use crate::state::{Context, Pose};
use rand::{Rng, RngExt};

/// Height of a block's centre that stands on the table \[m\].
pub const REST_HEIGHT_M: f64 = BLOCK_EDGE_M / 2.0;
/// Room between a spawned block and a box or the base block \[m\]: the opened hand must fit.
const CLEARANCE_M: f64 = 0.02;
/// Draws before a spawn area counts as blocked.
const MAX_DRAWS: usize = 1000;

/// Draws the scene of one episode.
///
/// # Errors
/// [`Error::Usage`] when the spawn area leaves no room (obstacles, base block or the distance to the goal).
pub fn draw_scene(task: Task, settings: &SceneSettings, rng: &mut impl Rng) -> Result<Scene> {
    let base = Pose::from_yaw([settings.base_xy_m[0], settings.base_xy_m[1], REST_HEIGHT_M], 0.0);
    for _ in 0..MAX_DRAWS {
        let block = Pose::from_yaw(draw_point(settings.spawn_x_m, settings.spawn_y_m, rng), draw_yaw(settings, rng));
        let context = match task {
            Task::PickUp => Context::None,
            Task::PickAndPlace => Context::Goal(draw_point(settings.goal_x_m, settings.goal_y_m, rng)),
            Task::Stack => Context::Base(base),
        };
        let apart = |a: [f64; 3], b: [f64; 3], least: f64| f64::hypot(a[0] - b[0], a[1] - b[1]) >= least;
        let fits = match context {
            Context::None => true,
            Context::Goal(goal) => apart(goal, block.position_m, MIN_TRAVEL_M) && clear(goal, &settings.obstacles),
            Context::Base(base) => apart(base.position_m, block.position_m, 2.0 * BLOCK_EDGE_M),
        };
        if fits && clear(block.position_m, &settings.obstacles) {
            return Ok(Scene {
                task,
                block,
                context,
                obstacles: settings.obstacles.clone(),
                friction: settings.friction,
                block_mass_kg: settings.block_mass_kg,
            });
        }
    }
    Err(Error::Usage(format!(
        "no room for {task} in the spawn area x {:?} m, y {:?} m after {MAX_DRAWS} draws: keep it clear of obstacles and of the \
         base block, and at least {MIN_TRAVEL_M} m wide for pick-and-place (keys scene.spawn_x_m, scene.spawn_y_m)",
        settings.spawn_x_m, settings.spawn_y_m
    )))
}

fn draw_point(x_m: [f64; 2], y_m: [f64; 2], rng: &mut impl Rng) -> [f64; 3] {
    let mut within = |[low, high]: [f64; 2]| low + (high - low) * rng.random::<f64>();
    [within(x_m), within(y_m), REST_HEIGHT_M]
}

fn draw_yaw(settings: &SceneSettings, rng: &mut impl Rng) -> f64 {
    // A cube looks the same every quarter turn.
    if settings.yaw { (rng.random::<f64>() - 0.5) * std::f64::consts::FRAC_PI_2 } else { 0.0 }
}

fn clear(point: [f64; 3], obstacles: &[Obstacle]) -> bool {
    let margin = BLOCK_EDGE_M / 2.0 + CLEARANCE_M;
    obstacles.iter().all(|o| (0..2).any(|i| (point[i] - o.center_m[i]).abs() > o.size_m[i] / 2.0 + margin))
}
