//! The episodes of one world, one after another.

use crate::env::{End, Env};
use crate::error::Result;

/// A world in the middle of an episode.
pub struct Episodes {
    env: Box<dyn Env>,
    /// Its place among all worlds: its episodes are number `place`, `place + worlds`, and so on.
    pub place: u64,
    /// How many worlds there are.
    pub worlds: u64,
    /// How many have begun.
    pub begun: u64,
    /// Actions of the present episode, one after another: they lead back to where it is.
    pub actions: Vec<f32>,
    /// What is seen of it now.
    pub observation: Vec<f32>,
    earned: f64,
}

/// An episode that has ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finished {
    /// Sum of its rewards.
    pub earned: f64,
    /// Its steps.
    pub steps: u64,
    /// Whether the task was solved.
    pub success: bool,
}

impl Episodes {
    /// Those of world `place` of `worlds`, at the beginning of the first.
    ///
    /// # Errors
    /// What the first episode returns.
    pub fn new(env: Box<dyn Env>, place: u64, worlds: u64) -> Result<Self> {
        let observation = vec![0.0; env.observation_len()];
        let mut world = Episodes { env, place, worlds, begun: 0, actions: Vec::new(), observation, earned: 0.0 };
        world.begin()?;
        Ok(world)
    }

    /// Begins the next.
    ///
    /// # Errors
    /// What the world returns.
    pub fn begin(&mut self) -> Result<()> {
        let episode = self.place + self.worlds * self.begun;
        (self.begun, self.earned) = (self.begun + 1, 0.0);
        self.actions.clear();
        self.env.reset(episode, &mut self.observation)
    }

    /// Comes back to where the world was when it had begun so many episodes and done these actions in the last.
    ///
    /// # Errors
    /// What the world returns when the episode begins.
    pub fn replay(&mut self, begun: u64, actions: &[f32]) -> Result<()> {
        self.begun = begun.saturating_sub(1);
        self.begin()?;
        for action in actions.chunks_exact(self.env.action_len()) {
            self.earned += f64::from(self.env.step(action, &mut self.observation).reward);
            self.actions.extend(action);
        }
        Ok(())
    }

    /// Steps of the present episode.
    pub fn steps(&self) -> usize {
        self.actions.len() / self.env.action_len()
    }

    /// One step; what ended comes with its last observation still in place.
    pub fn step(&mut self, action: &[f32]) -> (f32, Option<(End, Finished)>) {
        let outcome = self.env.step(action, &mut self.observation);
        self.actions.extend(action);
        self.earned += f64::from(outcome.reward);
        let steps = self.steps() as u64;
        let finished = Finished { earned: self.earned, steps, success: outcome.success };
        (outcome.reward, outcome.end.map(|end| (end, finished)))
    }
}
