//! Randomisation: where objects and goals are.

use super::Task;
use super::place::MIN_TRAVEL_M;
use crate::config::SceneSettings;
use crate::error::{Error, Result};
use crate::math::hypot;
use crate::robot::Robot;
use crate::scene::{Obstacle, Placed, Scene};
use crate::state::Pose;
use crate::task::{Area, Goal, Object, Place, Spread, Target};
use rand::{Rng, RngExt};
use std::sync::Arc;

/// Room between the faces of two objects at the start \[m\]: an edge of the paper's block.
const APART_M: f64 = 0.05;
/// Room between an object and an obstacle \[m\]: the opened hand must fit.
const CLEARANCE_M: f64 = 0.02;
/// Draws before an area counts as blocked.
const MAX_DRAWS: usize = 1000;

/// Draws the scene of one episode of a robot.
///
/// # Errors
/// [`Error::Usage`] when the places leave no room (reach, obstacles, other objects or the distance to a goal).
pub fn draw_scene(robot: &Arc<Robot>, task: &Arc<Task>, settings: &SceneSettings, rng: &mut impl Rng) -> Result<Scene> {
    for _ in 0..MAX_DRAWS {
        let poses: Vec<Pose> = task.objects.iter().map(|o| draw_place(o.place, o.rest_m(), settings, rng)).collect();
        let goal = |goal: &Goal| match goal.target {
            Target::At { place, .. } => Some(draw_goal(place, task.objects[goal.object].rest_m(), settings, rng)),
            _ => None,
        };
        let goals: Vec<[f64; 3]> = task.goals.iter().filter_map(goal).collect();
        if fits(robot, task, &settings.obstacles, &poses, &goals) {
            return Ok(scene_of((robot, task), settings, (poses, goals), rng));
        }
    }
    Err(no_room(robot, task, settings))
}

/// The scene in which objects and goals are there; frictions and masses are drawn.
pub fn scene_of(
    (robot, task): (&Arc<Robot>, &Arc<Task>),
    settings: &SceneSettings,
    (poses, goals): (Vec<Pose>, Vec<[f64; 3]>),
    rng: &mut impl Rng,
) -> Scene {
    // One number for all that have none of their own.
    let [friction, mass_kg] = [settings.friction, settings.block_mass_kg].map(|spread| spread.draw(rng));
    let mut own = |spread: Option<Spread>, common: f64| spread.map_or(common, |spread| spread.draw(rng));
    let placed = |(object, pose): (&Object, Pose)| Placed {
        pose,
        friction: own(object.friction, friction),
        mass_kg: own(object.mass_kg, mass_kg),
    };
    let objects = task.objects.iter().zip(poses).map(placed).collect();
    let (obstacles, finger_friction) = (settings.obstacles.clone(), settings.finger_friction.draw(rng));
    Scene { robot: Arc::clone(robot), task: Arc::clone(task), objects, goals, obstacles, finger_friction }
}

/// Whether what is to be moved is within reach, and everything clear of everything.
fn fits(robot: &Robot, task: &Task, obstacles: &[Obstacle], poses: &[Pose], goals: &[[f64; 3]]) -> bool {
    let free = |point: [f64; 3], half_m: f64| is_free(robot, point, half_m, obstacles);
    let half = |object: usize| task.objects[object].shape.half_width_m();
    let at = |object: usize| poses[object].position_m;
    let apart = |a: [f64; 3], b: [f64; 3], least: f64| hypot(a[0] - b[0], a[1] - b[1]) >= least;
    let objects = 0..poses.len();
    let beside = objects.clone().all(|i| (0..i).all(|k| apart(at(i), at(k), half(i) + half(k) + APART_M)));
    let whose: Vec<usize> =
        (0..task.goals.len()).filter(|k| task.place_number(*k).is_some()).map(|k| task.goals[k].object).collect();
    let reached = goals.iter().zip(&whose).all(|(goal, object)| {
        let others = objects.clone().filter(|other| other != object);
        let free_of_others = others.into_iter().all(|other| apart(*goal, at(other), half(*object) + half(other) + APART_M));
        apart(*goal, at(*object), MIN_TRAVEL_M) && free_of_others && free(*goal, half(*object))
    });
    let goals_apart =
        (0..goals.len()).all(|i| (0..i).all(|k| apart(goals[i], goals[k], half(whose[i]) + half(whose[k]) + APART_M)));
    beside && reached && goals_apart && (0..task.moved()).all(|object| free(at(object), half(object)))
}

/// Names the places that the task draws from, and what they must leave.
fn no_room(robot: &Robot, task: &Task, settings: &SceneSettings) -> Error {
    let (mut what, mut keys) = (Vec::new(), Vec::new());
    let mut add = |name: &str, place: Place| {
        let (words, key) = words(name, place, settings);
        if !what.contains(&words) {
            what.push(words);
            keys.push(key);
        }
    };
    task.objects.iter().for_each(|object| add(&object.name, object.place));
    for (k, goal) in task.goals.iter().enumerate() {
        if let (Target::At { place, .. }, Some(number)) = (&goal.target, task.place_number(k)) {
            add(&task.goal_names()[number], *place);
        }
    }
    let mut advice = String::new();
    if !task.goal_names().is_empty() {
        advice += &format!("; an object and its goal are at least {MIN_TRAVEL_M} m apart");
    }
    if task.objects.len() > 1 {
        advice += &format!("; the faces of two objects are at least {APART_M} m apart");
    }
    let found = format!("no room for {task} after {MAX_DRAWS} draws: {}", what.join(", "));
    let within = match robot.reach_m {
        Some([near, far]) => format!("within reach, {near} to {far} m around the foot of {}, and ", robot.name),
        None => String::new(),
    };
    Error::Usage(format!("{found}; keep {within}clear of obstacles{advice} (keys {})", keys.join(", ")))
}

/// A place in words, and its keys.
fn words(name: &str, place: Place, settings: &SceneSettings) -> (String, String) {
    let area = |x: [f64; 2], y: [f64; 2]| format!("x {x:?} m, y {y:?} m");
    match place {
        Place::Area(Area::Spawn) => (
            format!("the spawn area {}", area(settings.spawn_x_m, settings.spawn_y_m)),
            "scene.spawn_x_m, scene.spawn_y_m".into(),
        ),
        Place::Area(Area::Goal) => {
            (format!("the goal area {}", area(settings.goal_x_m, settings.goal_y_m)), "scene.goal_x_m, scene.goal_y_m".into())
        }
        Place::Area(Area::Base) => {
            let [x, y] = settings.base_xy_m;
            (format!("\"{name}\" at x {x} m, y {y} m"), "scene.base_xy_m".into())
        }
        Place::Around { x_m, y_m, .. } => (format!("\"{name}\" at x {x_m} m, y {y_m} m"), format!("x_m, y_m of \"{name}\"")),
    }
}

/// A pose on the table of an object whose centre is `rest_m` high.
fn draw_place(place: Place, rest_m: f64, settings: &SceneSettings, rng: &mut impl Rng) -> Pose {
    let point = draw_goal(place, rest_m, settings, rng);
    let yaw = match place {
        // A cube looks the same every quarter turn.
        Place::Area(Area::Spawn) if settings.yaw => (rng.random::<f64>() - 0.5) * std::f64::consts::FRAC_PI_2,
        Place::Area(_) => 0.0,
        Place::Around { yaw_rad, .. } => yaw_rad.draw(rng),
    };
    Pose::from_yaw(point, yaw)
}

fn draw_goal(place: Place, rest_m: f64, settings: &SceneSettings, rng: &mut impl Rng) -> [f64; 3] {
    let range = Spread::Between;
    let [x, y] = match place {
        Place::Area(Area::Spawn) => [range(settings.spawn_x_m), range(settings.spawn_y_m)],
        Place::Area(Area::Goal) => [range(settings.goal_x_m), range(settings.goal_y_m)],
        Place::Area(Area::Base) => settings.base_xy_m,
        Place::Around { x_m, y_m, .. } => [x_m, y_m],
    };
    let (x, y) = (x.draw(rng), y.draw(rng));
    [x, y, rest_m]
}

/// Within reach, and clear of all boxes.
fn is_free(robot: &Robot, point: [f64; 3], half_m: f64, obstacles: &[Obstacle]) -> bool {
    let margin = half_m + CLEARANCE_M;
    let away = hypot(point[0], point[1]);
    let within_reach = robot.reach_m.is_none_or(|[near, far]| (near..=far).contains(&away));
    within_reach && obstacles.iter().all(|o| (0..2).any(|i| (point[i] - o.center_m[i]).abs() > o.size_m[i] / 2.0 + margin))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::file::built_in::paper_robot;
    use crate::seed::stream;
    use crate::task::built_in::{pick_and_place, pick_up, stack};

    fn draw(task: &Arc<Task>, settings: &SceneSettings, index: u64) -> Scene {
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
            let (a, b) = (draw(&stack(), &fixed, index), draw(&stack(), &spread, index));
            assert_eq!(a.objects[0], Placed { pose: b.objects[0].pose, friction: 1.0, mass_kg: 0.1 });
            assert!((0.4..=1.2).contains(&b.objects[0].friction) && (0.05..=0.3).contains(&b.objects[0].mass_kg));
            let [x, y, _] = b.target_m(0);
            assert!((0.40..=0.50).contains(&x) && (0.30..=0.34).contains(&y));
            lightest = lightest.min(b.objects[0].mass_kg);
            heaviest = heaviest.max(b.objects[0].mass_kg);
        }
        assert!(lightest < 0.07 && heaviest > 0.28, "200 draws cover {lightest} to {heaviest} kg only");
    }

    #[test]
    fn nothing_is_drawn_out_of_reach() {
        let wide = SceneSettings { spawn_x_m: [0.1, 0.9], spawn_y_m: [-0.4, 0.4], ..SceneSettings::default() };
        for index in 0..200 {
            let [x, y, _] = draw(&pick_up(), &wide, index).objects[0].pose.position_m;
            assert!((0.295..=0.68).contains(&hypot(x, y)), "a block at {x} {y}");
        }
    }

    #[test]
    fn an_area_without_room_is_named_with_its_keys() {
        let refusal = |task: &Arc<Task>, settings: SceneSettings| {
            let drawn = draw_scene(&paper_robot(), task, &settings, &mut stream(5, "spawn test", 0));
            drawn.expect_err("there is no room").to_string()
        };
        let far = SceneSettings { goal_x_m: [1.2, 1.4], ..SceneSettings::default() };
        let message = refusal(&pick_and_place(), far);
        assert!(message.contains("goal area x [1.2, 1.4]") && message.contains("scene.goal_x_m, scene.goal_y_m"), "{message}");
        let on_base = [Spread::Fixed(0.47), Spread::Between([0.0, 0.01])];
        let crowded =
            SceneSettings { spawn_x_m: [0.45, 0.5], spawn_y_m: [0.0, 0.0], base_xy_m: on_base, ..SceneSettings::default() };
        let message = refusal(&stack(), crowded);
        assert!(message.contains("x 0.47 m, y [0.0, 0.01] m") && message.contains("scene.base_xy_m"), "{message}");
        let message = refusal(&pick_up(), SceneSettings { spawn_x_m: [1.2, 1.4], ..SceneSettings::default() });
        assert!(message.contains("0.295 to 0.68 m") && !message.contains("goal") && !message.contains("base"), "{message}");
    }
}
