//! `[task]` as it is written, and what it means.

use super::check::check;
use super::{Area, Goal, Object, Place, Shape, Spread, Target, Task, default_grip_m};
use crate::words::unknown;
use serde::{Deserialize, Serialize};

/// `[task]` of a pipeline file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TaskFile {
    /// Lower-case letters, digits and `-`.
    pub name: String,
    /// In words [default: made of the goals].
    #[serde(default)]
    pub instruction: Option<String>,
    /// `[[task.objects]]`.
    pub objects: Vec<ObjectFile>,
    /// `[[task.goals]]`.
    pub goals: Vec<GoalFile>,
}

/// `[[task.objects]]`: one of `box_m`, `cylinder_m`, `bin_m`; `at` or `x_m` and `y_m`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectFile {
    /// Lower-case letters, digits and `_`.
    pub name: String,
    /// Edges x y z \[m\].
    #[serde(default)]
    pub box_m: Option<[f64; 3]>,
    /// Radius and height \[m\].
    #[serde(default)]
    pub cylinder_m: Option<[f64; 2]>,
    /// Space between the walls along x and y, and their height \[m\].
    #[serde(default)]
    pub bin_m: Option<[f64; 3]>,
    /// The area of `[scene]` where it stands at the start.
    #[serde(default)]
    pub at: Option<Area>,
    /// Where it stands at the start, a number or a range \[m\].
    #[serde(default)]
    pub x_m: Option<Spread>,
    /// The same along y \[m\].
    #[serde(default)]
    pub y_m: Option<Spread>,
    /// Turn about the vertical at the start, a number or a range \[rad\] [default: 0].
    #[serde(default)]
    pub yaw_rad: Option<Spread>,
    /// Coulomb friction, a number or a range [default: `scene.friction`].
    #[serde(default)]
    pub friction: Option<Spread>,
    /// A number or a range \[kg\] [default: `scene.block_mass_kg`].
    #[serde(default)]
    pub mass_kg: Option<Spread>,
    /// Height of the tool point over its centre in a grasp \[m\] [default: 1 mm below, of objects flatter than 5 cm higher].
    #[serde(default)]
    pub grip_m: Option<f64>,
}

/// `[[task.goals]]`: `lift` with `height_m`; or `place` with `at`, with `x_m` and `y_m`, with `on`, or with `in`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GoalFile {
    /// The object to lift and hold.
    #[serde(default)]
    pub lift: Option<String>,
    /// Height of its centre above the table that counts \[m\].
    #[serde(default)]
    pub height_m: Option<f64>,
    /// The object to carry and release.
    #[serde(default)]
    pub place: Option<String>,
    /// The area of `[scene]` where the place is drawn.
    #[serde(default)]
    pub at: Option<Area>,
    /// The place, a number or a range \[m\].
    #[serde(default)]
    pub x_m: Option<Spread>,
    /// The same along y \[m\].
    #[serde(default)]
    pub y_m: Option<Spread>,
    /// Distance to the place that counts \[m\] [default: 0.05].
    #[serde(default)]
    pub tolerance_m: Option<f64>,
    /// The object on top of which it is put.
    #[serde(default)]
    pub on: Option<String>,
    /// The bin into which it is put.
    #[serde(default, rename = "in")]
    pub into: Option<String>,
}

/// Distance to a place that counts unless the file says so \[m\] (paper 4.1).
const TOLERANCE_M: f64 = 0.05;

impl TryFrom<TaskFile> for Task {
    type Error = String;

    fn try_from(file: TaskFile) -> Result<Self, String> {
        let names: Vec<&str> = file.objects.iter().map(|object| object.name.as_str()).collect();
        if let Some(twice) = names.iter().enumerate().find(|(i, name)| names[..*i].contains(name)) {
            return Err(format!("two objects are called \"{}\"; give each a name of its own", twice.1));
        }
        let goals =
            file.goals.iter().enumerate().map(|(k, goal)| of_goal(goal, &names).map_err(|why| format!("goal {k}: {why}")));
        let mut goals = goals.collect::<Result<Vec<Goal>, String>>()?;
        let objects =
            file.objects.iter().map(|object| of_object(object).map_err(|why| format!("object \"{}\": {why}", object.name)));
        let objects = objects.collect::<Result<Vec<Object>, String>>()?;
        // What the goals move comes first: its poses change, and rows begin with what changes.
        let is_moved = |i: &usize| goals.iter().any(|goal| goal.object == *i);
        let (moved, others): (Vec<usize>, Vec<usize>) = (0..objects.len()).partition(is_moved);
        let order: Vec<usize> = moved.into_iter().chain(others).collect();
        let place_of = |i: usize| order.iter().position(|at| *at == i).expect("every object has a place");
        for goal in &mut goals {
            goal.object = place_of(goal.object);
            if let Target::On(other) | Target::In(other) = &mut goal.target {
                *other = place_of(*other);
            }
        }
        let objects: Vec<Object> = order.iter().map(|i| objects[*i].clone()).collect();
        let mut task = Task { name: file.name, instruction: String::new(), objects, goals };
        check(&task)?;
        task.instruction = file.instruction.unwrap_or_else(|| instruction(&task));
        Ok(task)
    }
}

impl From<Task> for TaskFile {
    fn from(task: Task) -> Self {
        let name = |i: usize| task.objects[i].name.clone();
        let goal = |goal: &Goal| {
            let place = GoalFile { place: Some(name(goal.object)), ..GoalFile::default() };
            match &goal.target {
                Target::Lift { height_m } => {
                    GoalFile { lift: Some(name(goal.object)), height_m: Some(*height_m), ..GoalFile::default() }
                }
                Target::At { place: at, tolerance_m } => {
                    let (at, x_m, y_m, _) = said(*at);
                    GoalFile { at, x_m, y_m, tolerance_m: Some(*tolerance_m), ..place }
                }
                Target::On(other) => GoalFile { on: Some(name(*other)), ..place },
                Target::In(other) => GoalFile { into: Some(name(*other)), ..place },
            }
        };
        let object = |object: &Object| {
            let (at, x_m, y_m, yaw_rad) = said(object.place);
            let (box_m, cylinder_m, bin_m) = match object.shape {
                Shape::Box(size) => (Some(size), None, None),
                Shape::Cylinder { radius_m, height_m } => (None, Some([radius_m, height_m]), None),
                Shape::Bin { inner_m: [x, y], height_m } => (None, None, Some([x, y, height_m])),
            };
            let (friction, mass_kg, grip_m) = (object.friction, object.mass_kg, Some(object.grip_m));
            let name = object.name.clone();
            ObjectFile { name, box_m, cylinder_m, bin_m, at, x_m, y_m, yaw_rad, friction, mass_kg, grip_m }
        };
        TaskFile {
            goals: task.goals.iter().map(goal).collect(),
            objects: task.objects.iter().map(object).collect(),
            name: task.name,
            instruction: Some(task.instruction),
        }
    }
}

/// A place as it is written.
fn said(place: Place) -> (Option<Area>, Option<Spread>, Option<Spread>, Option<Spread>) {
    match place {
        Place::Area(area) => (Some(area), None, None, None),
        Place::Around { x_m, y_m, yaw_rad } => (None, Some(x_m), Some(y_m), Some(yaw_rad)),
    }
}

fn place(at: Option<Area>, xy: (Option<Spread>, Option<Spread>), yaw_rad: Option<Spread>) -> Result<Place, String> {
    match (at, xy, yaw_rad) {
        (Some(area), (None, None), None) => Ok(Place::Area(area)),
        (Some(_), (None, None), Some(_)) => Err("yaw_rad goes with x_m and y_m; of the spawn area say scene.yaw".into()),
        (None, (Some(x_m), Some(y_m)), yaw) => Ok(Place::Around { x_m, y_m, yaw_rad: yaw.unwrap_or(Spread::Fixed(0.0)) }),
        _ => Err("where? say at = \"spawn\", \"goal\" or \"base\" (an area of [scene]), or x_m and y_m".into()),
    }
}

fn of_object(file: &ObjectFile) -> Result<Object, String> {
    let shape = match (file.box_m, file.cylinder_m, file.bin_m) {
        (Some(size), None, None) => Shape::Box(size),
        (None, Some([radius_m, height_m]), None) => Shape::Cylinder { radius_m, height_m },
        (None, None, Some([x, y, height_m])) => Shape::Bin { inner_m: [x, y], height_m },
        _ => {
            return Err("which shape? say one of box_m = [x, y, z], cylinder_m = [radius, height], bin_m = [inner x, inner y, \
                        height]"
                .into());
        }
    };
    Ok(Object {
        name: file.name.clone(),
        shape,
        place: place(file.at, (file.x_m, file.y_m), file.yaw_rad)?,
        friction: file.friction,
        mass_kg: file.mass_kg,
        grip_m: file.grip_m.unwrap_or_else(|| default_grip_m(shape.half_height_m())),
    })
}

fn of_goal(file: &GoalFile, names: &[&str]) -> Result<Goal, String> {
    let known = |name: &str| names.iter().position(|known| *known == name).ok_or_else(|| unknown("object", name, names));
    let GoalFile { lift, height_m, place: placed, at, x_m, y_m, tolerance_m, on, into } = file;
    let says_place = at.is_some() || x_m.is_some() || y_m.is_some();
    let (object, target) = match (lift, placed, on, into, says_place) {
        (Some(object), None, None, None, false) => {
            let height_m = height_m.ok_or("how high? say height_m, of the object's centre above the table")?;
            (object, Target::Lift { height_m })
        }
        (None, Some(object), Some(on), None, false) => (object, Target::On(known(on)?)),
        (None, Some(object), None, Some(into), false) => (object, Target::In(known(into)?)),
        (None, Some(object), None, None, true) => {
            (object, Target::At { place: place(*at, (*x_m, *y_m), None)?, tolerance_m: tolerance_m.unwrap_or(TOLERANCE_M) })
        }
        _ => {
            return Err(
                "what is to be done? say lift = OBJECT with height_m; or place = OBJECT with one of: at = AREA, x_m and y_m, \
                        on = OBJECT, in = BIN"
                    .into(),
            );
        }
    };
    let is_at = matches!(target, Target::At { .. });
    if height_m.is_some() && lift.is_none() || tolerance_m.is_some() && !is_at {
        return Err("height_m goes with lift, tolerance_m with a place on the table".into());
    }
    Ok(Goal { object: known(object)?, target })
}

/// The goals in words: "Pick up the can and put it into the bin."
fn instruction(task: &Task) -> String {
    let name = |i: usize| task.objects[i].name.replace('_', " ");
    let words = |goal: &Goal| {
        let object = name(goal.object);
        match &goal.target {
            Target::Lift { height_m } => format!("pick up the {object} and hold it {:.0} cm above the table", height_m * 100.0),
            Target::At { .. } if task.goals.len() == 1 => format!("pick up the {object} and place it at the goal position"),
            Target::At { .. } => format!("pick up the {object} and place it at its goal position"),
            Target::On(other) => format!("pick up the {object} and stack it on the {}", name(*other)),
            Target::In(other) => format!("pick up the {object} and put it into the {}", name(*other)),
        }
    };
    let all = task.goals.iter().map(words).collect::<Vec<_>>().join(", then ");
    let (first, rest) = all.split_at(1);
    format!("{}{rest}.", first.to_uppercase())
}

#[cfg(test)]
mod tests {
    use super::super::built_in;
    use super::*;

    /// A task with these objects and goals, each a line of TOML between braces.
    fn read(objects: &[&str], goals: &[&str]) -> Result<Task, String> {
        let text = format!("name = \"t\"\nobjects = [{}]\ngoals = [{}]", objects.join(", "), goals.join(", "));
        toml::from_str(&text).map_err(|why: toml::de::Error| why.message().to_string())
    }

    const CUBE: &str = r#"{ name = "cube", box_m = [0.05, 0.05, 0.05], at = "spawn" }"#;
    const CAN: &str = r#"{ name = "can", cylinder_m = [0.03, 0.08], x_m = 0.5, y_m = [-0.1, 0.1] }"#;
    const BIN: &str = r#"{ name = "bin", bin_m = [0.1, 0.1, 0.03], at = "base" }"#;

    #[test]
    fn what_goals_move_comes_first_and_the_rest_follows_from_the_file() {
        let task = read(&[BIN, CUBE, CAN], &[r#"{ place = "can", in = "bin" }"#, r#"{ lift = "cube", height_m = 0.2 }"#])
            .expect("a task");
        let names: Vec<&str> = task.objects.iter().map(|object| object.name.as_str()).collect();
        assert_eq!((names, task.moved()), (vec!["cube", "can", "bin"], 2));
        assert_eq!((task.goals[0].object, &task.goals[0].target), (1, &Target::In(2)));
        assert_eq!(
            task.instruction,
            "Pick up the can and put it into the bin, then pick up the cube and hold it 20 cm above the table."
        );
        let names = ["can.reached", "can.grasped", "can.lifted", "can.in_bin", "can.released", "can.on_table", "can.at_rest"];
        assert_eq!(task.condition_names()[..7], names);
    }

    #[test]
    fn a_task_is_the_same_after_writing_and_reading() {
        let own = read(&[CUBE, CAN], &[r#"{ place = "cube", x_m = 0.5, y_m = 0.2 }"#, r#"{ place = "can", on = "cube" }"#]);
        for task in built_in::all().iter().map(|task| (**task).clone()).chain(own) {
            let text = toml::to_string(&task).expect("TOML");
            assert_eq!(toml::from_str::<Task>(&text).expect("a task"), task, "{text}");
            let text = serde_json::to_string(&task).expect("JSON");
            assert_eq!(serde_json::from_str::<Task>(&text).expect("a task"), task);
        }
    }

    #[test]
    fn what_cannot_be_a_task_is_refused_with_what_is_allowed() {
        let lift = r#"{ lift = "cube", height_m = 0.2 }"#;
        let cases: [(&[&str], &[&str], &str); 24] = [
            (&[], &[lift], r#"unknown object "cube""#),
            (&[CUBE], &[], "0 goals; allowed: 1 to 6"),
            (&[CUBE, CUBE], &[lift], r#"two objects are called "cube""#),
            (&[CUBE], &[r#"{ lift = "cub", height_m = 0.2 }"#], "did you mean cube?"),
            (&[CUBE], &[r#"{ lift = "cube" }"#], "how high? say height_m"),
            (&[CUBE], &[r#"{ lift = "cube", height_m = 0.02 }"#], "height_m = 0.02; allowed: 0.045 to 0.6"),
            (&[CUBE], &[r#"{ lift = "cube", height_m = 2.0 }"#], "height_m = 2; allowed: 0.045 to 0.6"),
            (&[CUBE], &[r#"{ place = "cube" }"#], "what is to be done?"),
            (&[CUBE], &[r#"{ place = "cube", at = "goal", on = "cube" }"#], "what is to be done?"),
            (&[CUBE], &[r#"{ place = "cube", x_m = 0.4 }"#], "where? say at"),
            (&[CUBE], &[r#"{ place = "cube", x_m = [0.5, 0.4], y_m = 0.0 }"#], "the lower end first"),
            (&[CUBE], &[r#"{ place = "cube", at = "goal", tolerance_m = 0.0 }"#], "tolerance_m = 0; allowed: 0.001 to 0.5"),
            (&[CUBE], &[r#"{ place = "cube", at = "goal", height_m = 0.2 }"#], "height_m goes with lift"),
            (&[CUBE], &[r#"{ place = "cube", on = "cube" }"#], "on or into itself"),
            (&[CUBE, CAN], &[lift, r#"{ place = "can", on = "cube" }"#], "must be the last goal"),
            (
                &[CUBE, CAN],
                &[r#"{ place = "can", on = "cube" }"#, r#"{ place = "cube", at = "goal" }"#],
                "\"cube\" is moved later",
            ),
            (&[CUBE], &[r#"{ place = "cube", at = "goal" }"#, lift], "moved by goal 0 already; one goal an object"),
            (&[CUBE, BIN], &[r#"{ place = "cube", on = "bin" }"#], "say in = \"bin\""),
            (&[CUBE, CAN], &[r#"{ place = "cube", in = "can" }"#], "is no bin"),
            (&[BIN], &[r#"{ lift = "bin", height_m = 0.2 }"#], "is a bin, which is fixed"),
            (
                &[CUBE, r#"{ name = "bin", bin_m = [0.05, 0.2, 0.03], at = "base" }"#],
                &[r#"{ place = "cube", in = "bin" }"#],
                "has 0.05 m between its walls",
            ),
            (&[r#"{ name = "cube", box_m = [0.2, 0.2, 0.2], at = "spawn" }"#], &[lift], "more than the 0.12 m that a hand opens"),
            (&[r#"{ name = "cube", at = "spawn" }"#], &[lift], "which shape?"),
            (
                &[r#"{ name = "a cube", box_m = [0.05, 0.05, 0.05], at = "spawn" }"#],
                &[r#"{ lift = "a cube", height_m = 0.2 }"#],
                "lower-case",
            ),
        ];
        for (objects, goals, expected) in cases {
            let why = read(objects, goals).expect_err(expected);
            assert!(why.contains(expected), "{objects:?} {goals:?}: {why}");
        }
        let mass = r#"{ name = "cube", box_m = [0.05, 0.05, 0.05], at = "spawn", mass_kg = 0.0 }"#;
        assert!(read(&[mass], &[lift]).expect_err("no mass").contains("mass_kg = 0; allowed: 0.001 to 10"));
        let grip = r#"{ name = "cube", box_m = [0.05, 0.05, 0.05], at = "spawn", grip_m = 0.1 }"#;
        assert!(read(&[grip], &[lift]).expect_err("held in the air").contains("grip_m = 0.1; allowed:"));
        let color = r#"{ name = "cube", box_m = [0.05, 0.05, 0.05], at = "spawn", color = "red" }"#;
        assert!(read(&[color], &[lift]).expect_err("no such key").contains("unknown field `color`"));
    }
}
