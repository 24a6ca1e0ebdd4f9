//! Randomisation: where block, goal and base stand.

use super::Task;
use super::pick_and_place::MIN_TRAVEL_M;
use crate::config::{SceneSettings, Spread};
use crate::error::{Error, Result};
use crate::math::hypot;
use crate::robot::Robot;
use crate::scene::{BLOCK_EDGE_M, Obstacle, Scene};
use crate::state::{Context, Pose};
use rand::{Rng, RngExt};
use std::sync::Arc;

/// Height of a block's centre that stands on the table \[m\].
pub const REST_HEIGHT_M: f64 = BLOCK_EDGE_M / 2.0;
/// Room between a spawned block and a box or the base block \[m\]: the opened hand must fit.
const CLEARANCE_M: f64 = 0.02;
/// Draws before a spawn area counts as blocked.
const MAX_DRAWS: usize = 1000;

/// Draws the scene of one episode of a robot.
///
/// # Errors
/// [`Error::Usage`] when spawn and goal areas leave no room (reach, obstacles, base block or the distance to the goal).
pub fn draw_scene(robot: &Arc<Robot>, task: Task, settings: &SceneSettings, rng: &mut impl Rng) -> Result<Scene> {
    let free = |point| is_free(robot, point, &settings.obstacles);
    for _ in 0..MAX_DRAWS {
        let block = Pose::from_yaw(draw_point(settings.spawn_x_m, settings.spawn_y_m, rng), draw_yaw(settings, rng));
        let context = match task {
            Task::PickUp => Context::None,
            Task::PickAndPlace => Context::Goal(draw_point(settings.goal_x_m, settings.goal_y_m, rng)),
            Task::Stack => {
                let [x, y] = settings.base_xy_m.map(|at| at.draw(rng));
                Context::Base(Pose::from_yaw([x, y, REST_HEIGHT_M], 0.0))
            }
        };
        let apart = |a: [f64; 3], b: [f64; 3], least: f64| hypot(a[0] - b[0], a[1] - b[1]) >= least;
        let fits = match context {
            Context::None => true,
            Context::Goal(goal) => apart(goal, block.position_m, MIN_TRAVEL_M) && free(goal),
            Context::Base(base) => apart(base.position_m, block.position_m, 2.0 * BLOCK_EDGE_M),
        };
        if fits && free(block.position_m) {
            return Ok(Scene {
                robot: Arc::clone(robot),
                task,
                block,
                context,
                obstacles: settings.obstacles.clone(),
                friction: settings.friction.draw(rng),
                block_mass_kg: settings.block_mass_kg.draw(rng),
            });
        }
    }
    Err(no_room(robot, task, settings))
}

/// Names the areas that the task draws from, and what they must leave.
fn no_room(robot: &Robot, task: Task, settings: &SceneSettings) -> Error {
    let area = |x: [f64; 2], y: [f64; 2]| format!("x {x:?} m, y {y:?} m");
    let spawn = area(settings.spawn_x_m, settings.spawn_y_m);
    let spawn_keys = "scene.spawn_x_m, scene.spawn_y_m";
    let (what, keys, advice) = match task {
        Task::PickUp => (format!("the spawn area {spawn}"), spawn_keys.to_string(), String::new()),
        Task::PickAndPlace => (
            format!("the spawn area {spawn} and the goal area {}", area(settings.goal_x_m, settings.goal_y_m)),
            format!("{spawn_keys}, scene.goal_x_m, scene.goal_y_m"),
            format!(" and each other: block and goal are at least {MIN_TRAVEL_M} m apart"),
        ),
        Task::Stack => (
            format!("the spawn area {spawn} beside the base block at {}", words(settings.base_xy_m)),
            format!("{spawn_keys}, scene.base_xy_m"),
            format!(" and the base block: the blocks' centres are at least {} m apart", 2.0 * BLOCK_EDGE_M),
        ),
    };
    let found = format!("no room for {task} after {MAX_DRAWS} draws: {what}");
    let within = match robot.reach_m {
        Some([near, far]) => format!("within reach, {near} to {far} m around the foot of {}, and ", robot.name),
        None => String::new(),
    };
    Error::Usage(format!("{found}; keep {within}clear of obstacles{advice} (keys {keys})"))
}

fn words([x, y]: [Spread; 2]) -> String {
    let one = |spread| match spread {
        Spread::Fixed(value) => format!("{value}"),
        Spread::Between(range) => format!("{range:?}"),
    };
    format!("x {} m, y {} m", one(x), one(y))
}

fn draw_point(x_m: [f64; 2], y_m: [f64; 2], rng: &mut impl Rng) -> [f64; 3] {
    let mut within = |[low, high]: [f64; 2]| low + (high - low) * rng.random::<f64>();
    [within(x_m), within(y_m), REST_HEIGHT_M]
}

fn draw_yaw(settings: &SceneSettings, rng: &mut impl Rng) -> f64 {
    // A cube looks the same every quarter turn.
    if settings.yaw { (rng.random::<f64>() - 0.5) * std::f64::consts::FRAC_PI_2 } else { 0.0 }
}

/// Within reach, and clear of all boxes.
fn is_free(robot: &Robot, point: [f64; 3], obstacles: &[Obstacle]) -> bool {
    let margin = BLOCK_EDGE_M / 2.0 + CLEARANCE_M;
    let away = hypot(point[0], point[1]);
    let within_reach = robot.reach_m.is_none_or(|[near, far]| (near..=far).contains(&away));
    within_reach && obstacles.iter().all(|o| (0..2).any(|i| (point[i] - o.center_m[i]).abs() > o.size_m[i] / 2.0 + margin))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::file::built_in::paper_robot;
    use crate::seed::stream;

    fn draw(task: Task, settings: &SceneSettings, index: u64) -> Scene {
        draw_scene(&paper_robot(), task, settings, &mut stream(5, "spawn test", index)).expect("there is room")
    }

    #[test]
    fn a_range_is_drawn_from_and_moves_nothing_else() {
        let fixed = SceneSettings::default();
        let spread = SceneSettings {
            base_xy_m: [Spread::Between([0.40, 0.50]), Spread::Between([0.30, 0.34])],
            friction: Spread::Between([0.4, 1.2]),
            block_mass_kg: Spread::Between([0.05, 0.3]),
            ..fixed.clone()
        };
        let (mut lightest, mut heaviest) = (f64::INFINITY, 0.0_f64);
        for index in 0..200 {
            let (a, b) = (draw(Task::Stack, &fixed, index), draw(Task::Stack, &spread, index));
            assert_eq!((a.block, a.friction, a.block_mass_kg), (b.block, 1.0, 0.1));
            assert!((0.4..=1.2).contains(&b.friction) && (0.05..=0.3).contains(&b.block_mass_kg));
            let [x, y, _] = b.target_m();
            assert!((0.40..=0.50).contains(&x) && (0.30..=0.34).contains(&y));
            lightest = lightest.min(b.block_mass_kg);
            heaviest = heaviest.max(b.block_mass_kg);
        }
        assert!(lightest < 0.07 && heaviest > 0.28, "200 draws cover {lightest} to {heaviest} kg only");
    }

    #[test]
    fn nothing_is_drawn_out_of_reach() {
        let wide = SceneSettings { spawn_x_m: [0.1, 0.9], spawn_y_m: [-0.4, 0.4], ..SceneSettings::default() };
        for index in 0..200 {
            let [x, y, _] = draw(Task::PickUp, &wide, index).block.position_m;
            assert!((0.295..=0.68).contains(&hypot(x, y)), "a block at {x} {y}");
        }
    }

    #[test]
    fn an_area_without_room_is_named_with_its_keys() {
        let refusal = |task, settings: SceneSettings| {
            let drawn = draw_scene(&paper_robot(), task, &settings, &mut stream(5, "spawn test", 0));
            drawn.expect_err("there is no room").to_string()
        };
        let far = SceneSettings { goal_x_m: [1.2, 1.4], ..SceneSettings::default() };
        let message = refusal(Task::PickAndPlace, far);
        assert!(message.contains("goal area x [1.2, 1.4]") && message.contains("scene.goal_x_m, scene.goal_y_m"), "{message}");
        let on_base = [Spread::Fixed(0.47), Spread::Between([0.0, 0.01])];
        let crowded =
            SceneSettings { spawn_x_m: [0.45, 0.5], spawn_y_m: [0.0, 0.0], base_xy_m: on_base, ..SceneSettings::default() };
        let message = refusal(Task::Stack, crowded);
        assert!(message.contains("x 0.47 m, y [0.0, 0.01] m") && message.contains("scene.base_xy_m"), "{message}");
        let message = refusal(Task::PickUp, SceneSettings { spawn_x_m: [1.2, 1.4], ..SceneSettings::default() });
        assert!(message.contains("0.295 to 0.68 m") && !message.contains("goal") && !message.contains("base"), "{message}");
    }
}
