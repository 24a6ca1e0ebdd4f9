//! What a task is: scene, spawn area, named success conditions, milestones of the reward and a dense one, failure classes. One file a task.

mod monitor;
pub mod pick_and_place;
pub mod pick_up;
mod reward;
mod spawn;
pub mod stack;

pub use monitor::{Monitor, Observation, Verdict};
pub use reward::dense;
pub use spawn::{REACH_M, REST_HEIGHT_M, draw_scene};

use crate::state::BASE_DIM;
use crate::words::unknown;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// The three tasks of the paper (section 4.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Task {
    /// Lift the block to 20 cm and hold it.
    PickUp,
    /// Carry the block to a goal on the table and release it there.
    PickAndPlace,
    /// Put the block on the base block and release it.
    Stack,
}

/// Why an episode failed. What ended it early comes before all: a command or a state that is no number; then the first that applies, in
/// this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FailureClass {
    /// The hand never came within reach of the block.
    NeverReached,
    /// Reached, but never held between the fingers.
    NeverGrasped,
    /// The block lies over, fell off the base block, or the base block was pushed away.
    Toppled,
    /// Held once, lost in the air.
    Dropped,
    /// Released on a support, but not where the task wants it.
    Misplaced,
    /// Still on its way when the steps ran out.
    TimedOut,
    /// The controller asked for a velocity that is no finite number.
    CommandNotFinite,
    /// The contact physics ended in numbers that are none: an arm pressed into a box, a block too light for its precision.
    SimulationBrokeDown,
}

impl FailureClass {
    /// All classes, in the order of tables.
    pub const ALL: [FailureClass; 8] = [
        FailureClass::NeverReached,
        FailureClass::NeverGrasped,
        FailureClass::Toppled,
        FailureClass::Dropped,
        FailureClass::Misplaced,
        FailureClass::TimedOut,
        FailureClass::CommandNotFinite,
        FailureClass::SimulationBrokeDown,
    ];

    /// The name in files and tables.
    pub fn name(self) -> &'static str {
        self.names()[0]
    }

    /// What happened, in words.
    pub fn words(self) -> &'static str {
        self.names()[1]
    }

    fn names(self) -> [&'static str; 2] {
        match self {
            FailureClass::NeverReached => ["never_reached", "the hand never came within reach of the block"],
            FailureClass::NeverGrasped => ["never_grasped", "the block was reached, but never held between the fingers"],
            FailureClass::Toppled => {
                ["toppled", "the block lies over or fell off the base block, or the base block was pushed away"]
            }
            FailureClass::Dropped => ["dropped", "the block was held once and lost in the air"],
            FailureClass::Misplaced => ["misplaced", "the block was released, but not where the task wants it"],
            FailureClass::TimedOut => ["timed_out", "the steps ran out on the way"],
            FailureClass::CommandNotFinite => ["command_not_finite", "a command was no finite number"],
            FailureClass::SimulationBrokeDown => ["simulation_broke_down", "the simulation ended in numbers that are none"],
        }
    }
}

impl Task {
    /// All tasks.
    pub const ALL: [Task; 3] = [Task::PickUp, Task::PickAndPlace, Task::Stack];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        ["pick-up", "pick-and-place", "stack"][self as usize]
    }

    /// D: 25, 28 or 32.
    pub fn state_dim(self) -> usize {
        BASE_DIM + [0, 3, 7][self as usize]
    }

    /// The instruction in words (LeRobot's task string).
    pub fn instruction(self) -> &'static str {
        [
            "Pick up the block and hold it 20 cm above the table.",
            "Pick up the block and place it at the goal position.",
            "Pick up the block and stack it on the base block.",
        ][self as usize]
    }

    /// Names of the conditions that are recorded: what has happened so far, then what must hold at once for 0.5 s.
    pub fn condition_names(self) -> &'static [&'static str] {
        match self {
            Task::PickUp => &pick_up::CONDITIONS,
            Task::PickAndPlace => &pick_and_place::CONDITIONS,
            Task::Stack => &stack::CONDITIONS,
        }
    }
}

impl fmt::Display for Task {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Task {
    type Err = String;

    fn from_str(s: &str) -> Result<Self, String> {
        Task::ALL.into_iter().find(|t| t.name() == s).ok_or_else(|| unknown("task", s, &Task::ALL.map(Task::name)))
    }
}
