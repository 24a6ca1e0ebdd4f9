//! The presets: pipeline files that the binary carries, so that it works from any directory.

use crate::task::Task;
use crate::words::unknown;
use std::str::FromStr;

/// Which of the sets of settings that come with hilt.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Preset {
    /// The method with every documented mend switched on.
    #[default]
    Best,
    /// As literal as can work, and the mends that lift hybrid imitation learning above behavior cloning; docs/notes.md says how far that was shown.
    Mended,
    /// As literal as can work.
    Paper,
}

impl Preset {
    /// All presets.
    pub const ALL: [Preset; 3] = [Preset::Best, Preset::Mended, Preset::Paper];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        ["best", "mended", "paper"][self as usize]
    }

    /// Its pipeline file for a task.
    pub(super) fn text(self, task: Task) -> &'static str {
        match (self, task) {
            (Preset::Best, Task::PickUp) => include_str!("../../pipelines/pick-up.toml"),
            (Preset::Best, Task::PickAndPlace) => include_str!("../../pipelines/pick-and-place.toml"),
            (Preset::Best, Task::Stack) => include_str!("../../pipelines/stack.toml"),
            (Preset::Mended, _) => include_str!("../../pipelines/mended.toml"),
            (Preset::Paper, Task::PickUp) => include_str!("../../pipelines/paper/pick-up.toml"),
            (Preset::Paper, Task::PickAndPlace) => include_str!("../../pipelines/paper/pick-and-place.toml"),
            (Preset::Paper, Task::Stack) => include_str!("../../pipelines/paper/stack.toml"),
        }
    }
}

impl FromStr for Preset {
    type Err = String;

    fn from_str(s: &str) -> Result<Self, String> {
        Preset::ALL.into_iter().find(|p| p.name() == s).ok_or_else(|| unknown("preset", s, &Preset::ALL.map(Preset::name)))
    }
}
