//! The presets: pipeline files that the binary carries, so that it works from any directory.

use crate::task::built_in;
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

    /// Its pipeline file for a task. Of one that does not come with hilt, `best` is every setting at its default; of one that is not the paper's,
    /// `paper` is what the paper did for stacking.
    pub(super) fn text(self, task: &str) -> &'static str {
        match (self, task) {
            (Preset::Best, task) => built_in::pipeline_text(task).unwrap_or_default(),
            (Preset::Mended, _) => include_str!("../../pipelines/mended.toml"),
            (Preset::Paper, "pick-up") => include_str!("../../pipelines/paper/pick-up.toml"),
            (Preset::Paper, "pick-and-place") => include_str!("../../pipelines/paper/pick-and-place.toml"),
            (Preset::Paper, _) => include_str!("../../pipelines/paper/stack.toml"),
        }
    }
}

impl FromStr for Preset {
    type Err = String;

    fn from_str(s: &str) -> Result<Self, String> {
        Preset::ALL.into_iter().find(|p| p.name() == s).ok_or_else(|| unknown("preset", s, &Preset::ALL.map(Preset::name)))
    }
}
