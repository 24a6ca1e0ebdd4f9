//! Algorithm 3: state cloning. The policy acts in the dynamics network from a demo's first state; L_SC (Eq. 5) compares the states.
//!
//! The segments of all demos (`segments.rs`) advance together as rows of one matrix. Sequential depth is the longest segment. The first
//! action of a segment is the policy's action in a demo state, which [`Acted`] has.

mod choices;
mod cloning;
mod pushes;
mod rollout;
mod segments;
mod setting;

pub use choices::Choices;
pub use cloning::StateCloning;
pub use pushes::Pushes;
pub use segments::{Segment, draw_segments};
pub use setting::Batch;

use super::acted::Acted;
use super::policy_loss::PolicyLoss;
use super::shards;
use crate::learn::models::{Dynamics, Policy};
use rayon::prelude::*;
use rollout::Rollout;
use segments::share;
use setting::Setting;

/// The workspace: one rollout a shard.
pub struct Workspace {
    loss: PolicyLoss,
    rollouts: Vec<Rollout>,
    sorted: Vec<Segment>,
}

impl Workspace {
    /// For actions of `dim` entries, with room for batches of at most `most_rows` states.
    pub fn new(dim: usize, most_rows: usize) -> Self {
        let mut rollouts = Vec::new();
        rollouts.resize_with(shards::MAX_SEGMENT_SHARDS, Rollout::default);
        Workspace { loss: PolicyLoss::new("L_SC (Eq. 5)", dim, most_rows), rollouts, sorted: Vec::with_capacity(most_rows) }
    }
}

/// Algorithm 3 over a batch in whose states the policy has `acted`: L_SC with its gradient. The dynamics network is only passed through,
/// never learned here.
///
/// # Panics
/// When the policy has acted in another number of states.
pub fn state_cloning<'a>(
    policy: &Policy,
    dynamics: &Dynamics,
    acted: &Acted,
    batch: Batch,
    choices: &Choices,
    work: &'a mut Workspace,
) -> &'a PolicyLoss {
    let (rows, Workspace { loss, rollouts, sorted }) = (batch.rows.len(), work);
    assert_eq!(acted.mean().len(), rows * batch.corpus.layout.action_dim(), "the policy has acted in other states");
    let (longest, most_rows) = (batch.corpus.longest(), batch.demos * batch.corpus.longest());
    sorted.clear();
    sorted.reserve(most_rows);
    sorted.extend_from_slice(batch.segments);
    sorted.sort_unstable_by_key(|s| (std::cmp::Reverse(s.steps), s.start));
    let active = shards::count(rows).min(shards::MAX_SEGMENT_SHARDS);
    rollouts.iter_mut().for_each(|rollout| rollout.reserve(policy, dynamics, most_rows, longest));
    let setting = Setting { policy, dynamics, mean: acted.mean(), batch, choices };
    rollouts[..active].par_iter_mut().enumerate().for_each(|(i, rollout)| rollout.run(share(sorted, active, i), setting));

    loss.begin(rows);
    loss.d_params.resize(policy.net.params().len(), 0.0);
    policy.net.finish_gradient(rollouts[..active].iter_mut().map(|rollout| &mut rollout.policy), &mut loss.d_params);
    for rollout in &rollouts[..active] {
        loss.value += rollout.loss;
        shards::add_scaled(&mut loss.d_log_std, &rollout.d_log_std, 1.0);
        for (start, d_first) in rollout.first_actions() {
            add_first(loss, rows, start, d_first);
        }
    }
    loss
}

/// The gradient with respect to the mean action in state `row` of the batch.
fn add_first(loss: &mut PolicyLoss, rows: usize, row: usize, d_first: &[f32]) {
    let (shard, start) = shards::place(rows, row);
    loss.d_mean[shard].write_row(row - start, d_first);
}
