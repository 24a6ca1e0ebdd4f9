//! The ways to fail at a task.

use serde::{Deserialize, Serialize};

/// Why an episode failed. What ended it early comes before all: a command or a state that is no number; then the first that applies, in
/// this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FailureClass {
    /// The hand never came within reach of the object.
    NeverReached,
    /// Reached, but never held between the fingers.
    NeverGrasped,
    /// The object lies over or fell off what it was put on, or what it is to be put on was pushed away.
    Toppled,
    /// Held once, lost in the air.
    Dropped,
    /// Released on a support, but not where the task wants it.
    Misplaced,
    /// Still on its way when the steps ran out.
    TimedOut,
    /// The controller asked for a velocity that is no finite number.
    CommandNotFinite,
    /// The contact physics ended in numbers that are none: an arm pressed into a box, an object too light for its precision.
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
            FailureClass::NeverReached => ["never_reached", "the hand never came within reach of the object"],
            FailureClass::NeverGrasped => ["never_grasped", "the object was reached, but never held between the fingers"],
            FailureClass::Toppled => {
                ["toppled", "the object lies over or fell off what it was put on, or what it is to be put on was pushed away"]
            }
            FailureClass::Dropped => ["dropped", "the object was held once and lost in the air"],
            FailureClass::Misplaced => ["misplaced", "the object was released, but not where the task wants it"],
            FailureClass::TimedOut => ["timed_out", "the steps ran out on the way"],
            FailureClass::CommandNotFinite => ["command_not_finite", "a command was no finite number"],
            FailureClass::SimulationBrokeDown => ["simulation_broke_down", "the simulation ended in numbers that are none"],
        }
    }
}
