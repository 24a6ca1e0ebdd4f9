//! What a run has made so far.

use super::metrics::EpochMetrics;
use super::selection::Selection;
use crate::learn::models::Policy;

/// What a [`super::Checkpoint`] says of the run, beside the method's own state.
#[derive(Default)]
pub struct History {
    /// All epochs so far.
    pub rows: Vec<EpochMetrics>,
    /// The candidates so far.
    pub selection: Selection,
    /// The policy that the selection prefers.
    pub best: Option<Policy>,
}
