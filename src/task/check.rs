//! What can be a task.

use super::{MOST_OBJECTS, Object, Place, Shape, Spread, Target, Task};
use crate::words::shown;

/// What the joints' positions and velocities are called in a state.
const JOINTS: [&str; 2] = ["q", "dq"];
/// Whose names objects may not have.
const NOT_FREE: &str = "a part of every state (q, dq) or a goal of this task on the table; give it another name";
/// Longest name of a task or an object.
const LONGEST_NAME: usize = 32;
/// Edges of an object \[m\].
const EDGES_M: [f64; 2] = [0.005, 1.0];
/// Widest footprint of an object that is picked up \[m\]: no hand here opens wider.
const WIDEST_GRASP_M: f64 = 0.12;
/// Positions on the table \[m\].
const REACH_M: f64 = 2.0;
/// Room that an object in a bin has beside it \[m\], both sides together.
const BIN_ROOM_M: f64 = 0.01;
/// Masses \[kg\]: of a lighter object the simulator's single precision loses the motion.
const MASSES_KG: [f64; 2] = [0.001, 10.0];
/// Coulomb friction.
const FRICTIONS: [f64; 2] = [0.0, 10.0];
/// Distances to a place that count \[m\].
const TOLERANCES_M: [f64; 2] = [0.001, 0.5];
/// Fingertips reach below the tool point: it may be this much above the top of a flat object \[m\].
const HIGHEST_GRIP_M: f64 = 0.02;
/// An object that is lifted is at least this much higher than it stood \[m\].
const LEAST_LIFT_M: f64 = 0.02;
/// Highest lift \[m\]: beyond, no arm here holds its hand level.
const HIGHEST_LIFT_M: f64 = 0.6;

/// Refuses what cannot be a task.
pub(super) fn check(task: &Task) -> Result<(), String> {
    name("the task", &task.name, '-')?;
    for (what, n) in [("objects", task.objects.len()), ("goals", task.goals.len())] {
        if !(1..=MOST_OBJECTS).contains(&n) {
            return Err(format!("{n} {what}; allowed: 1 to {MOST_OBJECTS}"));
        }
    }
    for object in &task.objects {
        check_object(object).map_err(|why| format!("object \"{}\": {why}", object.name))?;
    }
    for goal in 0..task.goals.len() {
        check_goal(task, goal).map_err(|why| format!("goal {goal}: {why}"))?;
    }
    // Columns of datasets and of the log are called by them.
    let taken: Vec<String> = JOINTS.map(String::from).into_iter().chain(task.goal_names()).collect();
    let clash = task.objects.iter().find(|object| taken.contains(&object.name));
    clash.map_or(Ok(()), |object| Err(format!("an object is called \"{}\", as is {}", object.name, NOT_FREE)))
}

fn name(of: &str, name: &str, joint: char) -> Result<(), String> {
    let allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == joint;
    let fits = !name.is_empty() && name.len() <= LONGEST_NAME && name.chars().all(allowed);
    if fits && name.starts_with(|c: char| c.is_ascii_lowercase()) {
        return Ok(());
    }
    Err(format!(
        "{of} is called \"{}\"; allowed: 1 to {LONGEST_NAME} lower-case letters, digits and {joint}, a letter first",
        shown(name)
    ))
}

fn within(what: &str, value: f64, [low, high]: [f64; 2]) -> Result<(), String> {
    if (low..=high).contains(&value) { Ok(()) } else { Err(format!("{what} = {value}; allowed: {low} to {high}")) }
}

fn spread(what: &str, spread: Spread, allowed: [f64; 2]) -> Result<(), String> {
    let [low, high] = spread.ends();
    if low > high {
        return Err(format!("{what} = [{low}, {high}]; allowed: the lower end first, [low, high]"));
    }
    [low, high].into_iter().try_for_each(|end| within(what, end, allowed))
}

fn check_place(place: Place) -> Result<(), String> {
    let Place::Around { x_m, y_m, yaw_rad } = place else { return Ok(()) };
    spread("x_m", x_m, [-REACH_M, REACH_M])?;
    spread("y_m", y_m, [-REACH_M, REACH_M])?;
    spread("yaw_rad", yaw_rad, [-std::f64::consts::PI, std::f64::consts::PI])
}

fn check_object(object: &Object) -> Result<(), String> {
    name("it", &object.name, '_')?;
    let edges = match object.shape {
        Shape::Box(size) => size.to_vec(),
        Shape::Cylinder { radius_m, height_m } => vec![2.0 * radius_m, height_m],
        Shape::Bin { inner_m: [x, y], height_m } => vec![x, y, height_m],
    };
    edges.into_iter().try_for_each(|edge| within("an edge or diameter [m]", edge, EDGES_M))?;
    let half = object.rest_m();
    within("grip_m", object.grip_m, [-half, half + HIGHEST_GRIP_M])?;
    object.friction.map_or(Ok(()), |friction| spread("friction", friction, FRICTIONS))?;
    object.mass_kg.map_or(Ok(()), |mass| spread("mass_kg", mass, MASSES_KG))?;
    check_place(object.place)
}

fn check_goal(task: &Task, k: usize) -> Result<(), String> {
    let (goal, name) = (&task.goals[k], |i: usize| &task.objects[i].name);
    let object = &task.objects[goal.object];
    if object.shape.is_fixed() {
        return Err(format!("\"{}\" is a bin, which is fixed; goals move boxes and cylinders", object.name));
    }
    let [x, y, _] = object.shape.half_m();
    if 2.0 * x.min(y) > WIDEST_GRASP_M {
        return Err(format!(
            "\"{}\" is {} m wide, more than the {WIDEST_GRASP_M} m that a hand opens",
            object.name,
            2.0 * x.min(y)
        ));
    }
    if let Some(before) = task.goals[..k].iter().position(|other| other.object == goal.object) {
        return Err(format!("\"{}\" is moved by goal {before} already; one goal an object", object.name));
    }
    match &goal.target {
        Target::Lift { height_m } => {
            within("height_m", *height_m, [object.rest_m() + LEAST_LIFT_M, HIGHEST_LIFT_M])?;
            if k + 1 < task.goals.len() {
                return Err(format!(
                    "\"{}\" is lifted and held, so this must be the last goal: the hand is not free after it",
                    object.name
                ));
            }
            Ok(())
        }
        Target::At { place, tolerance_m } => {
            within("tolerance_m", *tolerance_m, TOLERANCES_M)?;
            check_place(*place)
        }
        Target::On(other) | Target::In(other) if *other == goal.object => {
            Err(format!("\"{}\" cannot be put on or into itself", object.name))
        }
        Target::On(other) => {
            if task.objects[*other].shape.is_fixed() {
                return Err(format!("\"{}\" is a bin, nothing stands on it; say in = \"{0}\"", name(*other)));
            }
            if task.goals[k..].iter().any(|later| later.object == *other) {
                return Err(format!("\"{}\" is moved later; first put it where it is to stay", name(*other)));
            }
            if let Some(before) = task.goals[..k].iter().position(|goal| goal.target == Target::On(*other)) {
                let on_it = name(task.goals[before].object);
                return Err(format!("\"{}\" has \"{on_it}\" on it already (goal {before}); say on = \"{on_it}\"", name(*other)));
            }
            Ok(())
        }
        Target::In(other) => {
            let Shape::Bin { inner_m, .. } = task.objects[*other].shape else {
                return Err(format!("\"{}\" is no bin; give it bin_m, or say on = \"{0}\"", name(*other)));
            };
            if let Some(before) = task.goals[..k].iter().position(|goal| goal.target == Target::In(*other)) {
                let there = name(task.goals[before].object);
                return Err(format!(
                    "\"{}\" has \"{there}\" in its middle already (goal {before}); give each a bin",
                    name(*other)
                ));
            }
            let narrow = inner_m[0].min(inner_m[1]);
            let wide = 2.0 * object.shape.half_width_m();
            if wide + BIN_ROOM_M > narrow {
                return Err(format!(
                    "\"{}\" is {wide} m wide and \"{}\" has {narrow} m between its walls; it needs {BIN_ROOM_M} m more than the object",
                    object.name,
                    name(*other)
                ));
            }
            Ok(())
        }
    }
}
