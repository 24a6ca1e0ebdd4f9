//! What a client asks of a world.

use super::link::Message;
use super::rows::Rows;
use super::value::Value;
use crate::config::MOST_HORIZON_STEPS;

/// What episodes are for.
pub const SPLITS: [&str; 2] = ["evaluation", "training"];

/// Which episode is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wanted {
    /// The run's seed.
    pub seed: u64,
    /// The episode's number.
    pub episode: u64,
    /// Control steps before it is given up.
    pub horizon_steps: u32,
    /// Whether it is none of an evaluation's.
    pub training: bool,
}

/// A message in words of ours.
pub enum Asked {
    /// Another episode.
    Reset(Wanted),
    /// A control step with this action.
    Step(Vec<f32>),
}

/// Reads messages, of actions for these rows.
#[derive(Clone, Debug)]
pub struct Questions {
    rows: Rows,
    /// The first episode of a client that says nothing else.
    first: Wanted,
}

impl Questions {
    /// Of clients who begin with `first`.
    pub fn new(rows: &Rows, first: Wanted) -> Self {
        Questions { rows: rows.clone(), first }
    }

    /// What a message asks, after episode `last`.
    ///
    /// # Errors
    /// Says what is wrong with it.
    pub fn read(&self, message: &Message, last: Option<Wanted>) -> Result<Asked, String> {
        let value = message.value()?;
        if let Some(reset) = value.get("reset") {
            return self.wanted(reset, last).map(Asked::Reset);
        }
        let Some(step) = value.get("step") else { return Err("a message has the key \"reset\" or \"step\"".into()) };
        let Some(action) = step.get("action") else { return Err("\"step\" must be a map with an \"action\"".into()) };
        let numbers = action.numbers().map_err(|why| format!("\"action\" holds {why}"))?;
        let (width, shape) = (self.rows.layout().action_dim(), numbers.shape.clone());
        match numbers.rows(width).as_deref() {
            Some([row]) => Ok(Asked::Step(row.clone())),
            _ => Err(format!("\"action\" has shape {shape:?}; it must be one row of {width} numbers")),
        }
    }

    /// What comes after `last`, unless the message says otherwise.
    fn wanted(&self, reset: &Value, last: Option<Wanted>) -> Result<Wanted, String> {
        if !matches!(reset, Value::Map(_)) {
            return Err(format!("\"reset\" is {}; it must be a map, empty for the next episode", reset.kind()));
        }
        let number = |key: &str| match reset.get(key) {
            None | Some(Value::Nil) => Ok(None),
            Some(value) => {
                value.as_u64().map(Some).ok_or_else(|| format!("\"{key}\" of \"reset\" must be a whole number from 0"))
            }
        };
        let next = last.map_or(self.first, |last| Wanted { episode: last.episode.saturating_add(1), ..last });
        let training = match reset.get("episodes").map(Value::as_text) {
            None => next.training,
            Some(Some(split)) if SPLITS.contains(&split) => split == SPLITS[1],
            Some(_) => return Err(format!("\"episodes\" of \"reset\" must be one of {SPLITS:?}")),
        };
        let seed = number("seed")?;
        let begins = seed.is_some() || training != next.training;
        let horizon_steps = number("horizon_steps")?.unwrap_or(u64::from(next.horizon_steps));
        if !(1..=u64::from(MOST_HORIZON_STEPS)).contains(&horizon_steps) {
            return Err(format!("\"horizon_steps\" of \"reset\" is {horizon_steps}; allowed: 1 to {MOST_HORIZON_STEPS}"));
        }
        Ok(Wanted {
            seed: seed.unwrap_or(next.seed),
            episode: number("episode")?.unwrap_or(if begins { 0 } else { next.episode }),
            horizon_steps: horizon_steps as u32,
            training,
        })
    }
}
