//! What a rollout happens in.

use super::choices::Choices;
use super::segments::Segment;
use crate::learn::models::{Corpus, Dynamics, Policy};

/// The demos of one update.
#[derive(Clone, Copy)]
pub struct Batch<'a> {
    /// The training demos.
    pub corpus: &'a Corpus,
    /// Transitions of the corpus, demo by demo.
    pub rows: &'a [usize],
    /// Number of demos.
    pub demos: usize,
    /// What the coins of stochastic recovery have left: [`super::draw_segments`].
    pub segments: &'a [Segment],
    /// Standard normal numbers, rows x A; empty when the mean is taken.
    pub noise: &'a [f32],
    /// Disturbances of the rollouts' actions \[rad/s\], rows x A; empty when there are none.
    pub pushes: &'a [f32],
}

/// What the rollouts of one update have in common.
#[derive(Clone, Copy)]
pub struct Setting<'a> {
    /// pi_theta.
    pub policy: &'a Policy,
    /// f_phi.
    pub dynamics: &'a Dynamics,
    /// The policy's mean actions in the demos' states, standardised, rows x A.
    pub mean: &'a [f32],
    /// The demos.
    pub batch: Batch<'a>,
    /// The keys.
    pub choices: &'a Choices,
}
