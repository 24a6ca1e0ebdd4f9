//! A world to learn in by trial: what reinforcement learning sees of a simulator.

use crate::error::Result;

/// How an episode ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// For good: nothing that could still be earned was cut off.
    Terminated,
    /// The steps ran out: what would have come is worth what the last observation promises.
    Truncated,
}

/// What a step brought.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// Reward of the step, finite.
    pub reward: f32,
    /// Whether the episode is over; the next call is [`Env::reset`] then.
    pub end: Option<End>,
    /// Whether the task was solved in this step.
    pub success: bool,
}

/// A world with episodes. What happens depends on nothing but the number of the episode and the actions, so that a world comes back to
/// where it was when its actions are repeated.
pub trait Env: Send {
    /// Numbers of an observation.
    fn observation_len(&self) -> usize;

    /// Numbers of an action.
    fn action_len(&self) -> usize;

    /// Begins episode number `episode` and writes what is seen first into `observation` ([`Env::observation_len`] finite numbers).
    ///
    /// # Errors
    /// When there is no such episode, e.g. because its scene has no room.
    fn reset(&mut self, episode: u64, observation: &mut [f32]) -> Result<()>;

    /// Takes `action` ([`Env::action_len`] finite numbers) and writes what is seen then; after [`Env::reset`], and not after an end.
    fn step(&mut self, action: &[f32], observation: &mut [f32]) -> Outcome;
}
