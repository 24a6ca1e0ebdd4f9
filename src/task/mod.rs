//! What a task is, as its file says it: objects, where they stand, and goals in order. Everything else follows from it.

pub mod built_in;
mod check;
mod failure;
mod file;
mod shape;
mod spread;

pub use failure::FailureClass;
pub use file::TaskFile;
pub use shape::{BIN_WALL_M, Shape};
pub use spread::Spread;

use serde::{Deserialize, Serialize};
use std::fmt;

/// Most objects of a task, and most goals.
pub const MOST_OBJECTS: usize = 6;
/// Height of the tool point over the object's centre in a grasp \[m\]: fingertips that close around a 5 cm cube stay 5 mm above the table.
pub const GRASP_OVER_CENTER_M: f64 = -0.001;
/// Height of the tool point over an object's support in the lowest grasp \[m\]: the same of a flatter object.
const LOWEST_GRASP_M: f64 = 0.024;

/// A task: `[task]` of a pipeline file.
///
/// ```
/// use hilt::task::built_in;
///
/// let sort = built_in::find("sort")?;
/// assert_eq!((sort.objects.len(), sort.moved()), (2, 2));
/// assert!(built_in::find("srot").unwrap_err().contains("did you mean sort?"));
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "TaskFile", into = "TaskFile")]
pub struct Task {
    /// Its name: of directories, datasets and weights.
    pub name: String,
    /// In words, for people and for LeRobot.
    pub instruction: String,
    /// What stands on the table: first what the goals move, then the others.
    pub objects: Vec<Object>,
    /// What is to be done, in the order of the demonstrations; at the end all must hold.
    pub goals: Vec<Goal>,
}

/// A body on the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Its name: of columns, frames and conditions.
    pub name: String,
    /// Its shape; a bin is fixed, all else can be moved.
    pub shape: Shape,
    /// Where it stands at the start.
    pub place: Place,
    /// Coulomb friction against everything; `None` = `scene.friction`.
    pub friction: Option<Spread>,
    /// \[kg\]; `None` = `scene.block_mass_kg`.
    pub mass_kg: Option<Spread>,
    /// Height of the tool point over its centre in a grasp \[m\].
    pub grip_m: f64,
}

/// A place on the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// An area of `[scene]`.
    Area(Area),
    /// Numbers of the task's own.
    Around {
        /// \[m\].
        x_m: Spread,
        /// \[m\].
        y_m: Spread,
        /// Turn about the vertical \[rad\].
        yaw_rad: Spread,
    },
}

/// The areas of `[scene]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Area {
    /// `scene.spawn_x_m`, `scene.spawn_y_m`, `scene.yaw`.
    Spawn,
    /// `scene.goal_x_m`, `scene.goal_y_m`.
    Goal,
    /// `scene.base_xy_m`.
    Base,
}

/// What is to be done with an object.
#[derive(Clone, Debug, PartialEq)]
pub struct Goal {
    /// The object, by its place in [`Task::objects`].
    pub object: usize,
    /// Where it is to be.
    pub target: Target,
}

/// Where an object is to be: the vocabulary of goals.
#[derive(Clone, Debug, PartialEq)]
pub enum Target {
    /// Held in the air, its centre at least this high \[m\].
    Lift {
        /// Height of the centre above the table \[m\].
        height_m: f64,
    },
    /// Released on the table.
    At {
        /// Where.
        place: Place,
        /// Distance that counts \[m\].
        tolerance_m: f64,
    },
    /// Released on top of another object.
    On(usize),
    /// Released within the walls of a bin.
    In(usize),
}

impl Task {
    /// How many objects, from the first, the goals move.
    pub fn moved(&self) -> usize {
        self.goals.len()
    }

    /// The goal that moves an object, if one does.
    pub fn goal_of(&self, object: usize) -> Option<usize> {
        self.goals.iter().position(|goal| goal.object == object)
    }

    /// Names of the goals that are places on the table, in their order: `goal`, of several `<object>_goal`.
    pub fn goal_names(&self) -> Vec<String> {
        let at: Vec<&Goal> = self.goals.iter().filter(|goal| matches!(goal.target, Target::At { .. })).collect();
        let name = |goal: &&Goal| match at.len() {
            1 => "goal".into(),
            _ => format!("{}_goal", self.objects[goal.object].name),
        };
        at.iter().map(name).collect()
    }

    /// Which of [`Task::goal_names`] a goal is, if it is a place on the table.
    pub fn place_number(&self, goal: usize) -> Option<usize> {
        let is_at = |goal: &&Goal| matches!(goal.target, Target::At { .. });
        is_at(&&self.goals[goal]).then(|| self.goals[..goal].iter().filter(is_at).count())
    }
}

impl fmt::Display for Task {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)
    }
}

impl Object {
    /// Height of its centre when it stands on the table \[m\].
    pub fn rest_m(&self) -> f64 {
        self.shape.half_height_m()
    }

    /// The height over its centre by which distances to the hand are measured \[m\]: 0, or higher where it is held higher.
    pub fn held_m(&self) -> f64 {
        self.grip_m.max(0.0)
    }
}

/// Where an object of this half height is grasped unless its file says so.
fn default_grip_m(half_height_m: f64) -> f64 {
    let cube = LOWEST_GRASP_M - GRASP_OVER_CENTER_M;
    if half_height_m < cube { LOWEST_GRASP_M - half_height_m } else { GRASP_OVER_CENTER_M }
}
