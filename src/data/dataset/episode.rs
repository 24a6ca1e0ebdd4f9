//! What a dataset is made of.

use crate::demo::{Demo, Episode};
use crate::error::Result;
use std::borrow::Cow;

/// A demo and what the dataset keeps beside it.
#[derive(Clone, Debug)]
pub struct DatasetEpisode {
    /// Number of the episode in the recordings.
    pub source_index: u64,
    /// States and actions.
    pub demo: Demo,
    /// r_t of each of the T actions: milestones reached by it.
    pub rewards: Vec<f32>,
    /// Whether the task is solved at the end.
    pub success: bool,
}

impl DatasetEpisode {
    /// Of a recorded episode and its demo. A recording notes a reward with the state that earns it; here it belongs to the
    /// action that led there.
    pub fn of(episode: &Episode, demo: Demo) -> Self {
        let arrived = episode.steps.iter().skip(1).chain([&episode.last]);
        DatasetEpisode {
            source_index: episode.index,
            demo,
            rewards: arrived.map(|s| s.reward as f32).collect(),
            success: episode.success,
        }
    }

    /// Bytes of its numbers.
    pub fn bytes(&self) -> usize {
        let numbers = [self.demo.states(), self.demo.actions(), self.demo.executed(), &self.rewards];
        numbers.iter().map(|n| size_of_val(*n)).sum()
    }
}

/// What gives the episode at a position.
type Give<'a> = Box<dyn Fn(usize) -> Result<Cow<'a, DatasetEpisode>> + Sync + 'a>;

/// The episodes that a dataset is made of, each asked for once, on any thread, when its turn comes.
pub struct Episodes<'a> {
    /// T of each.
    pub(super) steps: Vec<usize>,
    pub(super) give: Give<'a>,
}

impl<'a> Episodes<'a> {
    /// Episodes of so many `steps`; `give` has the one at a position.
    pub fn new(steps: Vec<usize>, give: impl Fn(usize) -> Result<Cow<'a, DatasetEpisode>> + Sync + 'a) -> Self {
        Episodes { steps, give: Box::new(give) }
    }
}

impl<'a> From<&'a [DatasetEpisode]> for Episodes<'a> {
    fn from(all: &'a [DatasetEpisode]) -> Self {
        Episodes::new(all.iter().map(|episode| episode.demo.len()).collect(), |at| Ok(Cow::Borrowed(&all[at])))
    }
}
