//! A learned policy as a controller.

use crate::learn::Policy;
use crate::sim::Controller;
use crate::state::Action;
use crate::tasks::Observation;
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;

/// Asks a policy for each action: its mean, or a sample when there is a random stream.
#[derive(Clone, Debug)]
pub struct PolicyController {
    policy: Arc<Policy>,
    sampling: Option<ChaCha8Rng>,
}

impl PolicyController {
    /// Takes the mean action without `sampling`, otherwise samples with it.
    pub fn new(policy: Arc<Policy>, sampling: Option<ChaCha8Rng>) -> Self {
        PolicyController { policy, sampling }
    }
}

impl Controller for PolicyController {
    fn command(&mut self, seen: &Observation) -> Action {
        let row = seen.state.to_row();
        let action = match &mut self.sampling {
            Some(rng) => self.policy.sample(&row, rng),
            None => self.policy.act(&row),
        };
        action.iter().map(|v| f64::from(*v)).collect()
    }
}
