//! What a world tells a client of a moment.

use super::asked::Wanted;
use super::rows::Rows;
use super::value::Value;
use crate::demo::Episode;
use crate::eval::Trial;
use crate::sim::fallen;
use crate::tasks::{FailureClass, Observation, Verdict};

/// Writes answers.
#[derive(Clone, Debug)]
pub struct Teller {
    rows: Rows,
    /// Names of the task's conditions.
    conditions: Vec<String>,
}

impl Teller {
    /// Of a task whose rows and conditions these are.
    pub fn new(rows: &Rows, conditions: Vec<String>) -> Self {
        Teller { rows: rows.clone(), conditions }
    }

    /// The answer to a reset: the first moment.
    pub fn first(&self, seen: &Observation, verdict: &Verdict, wanted: Wanted) -> Value<'_> {
        let (mut answer, mut info) = self.moment(&seen.state.to_row(), verdict.reward, &verdict.conditions, false);
        info.insert("episode", Value::Int(wanted.episode as i64));
        info.insert("seed", Value::Int(wanted.seed as i64));
        info.insert("horizon_steps", Value::Int(i64::from(wanted.horizon_steps)));
        answer.insert("info", info);
        answer
    }

    /// The answer to a step that is not the last.
    pub fn step(&self, seen: &Observation, verdict: &Verdict) -> Value<'_> {
        let (mut answer, info) = self.moment(&seen.state.to_row(), verdict.reward, &verdict.conditions, false);
        answer.insert("terminated", Value::Bool(false));
        answer.insert("truncated", Value::Bool(false));
        answer.insert("info", info);
        answer
    }

    /// The last answer of an episode.
    pub fn end(&self, episode: &Episode, wanted: Wanted) -> Value<'_> {
        let (last, trial) = (&episode.last, Trial::of(episode));
        let broken = matches!(episode.failure, Some(FailureClass::CommandNotFinite | FailureClass::SimulationBrokeDown));
        // Such a moment has been paid before.
        let reward = if broken { 0.0 } else { last.reward };
        let terminated = episode.success || broken || fallen(&last.objects);
        let (mut answer, mut info) = self.moment(&last.state.to_row(), reward, &last.conditions, episode.success);
        answer.insert("terminated", Value::Bool(terminated));
        answer.insert("truncated", Value::Bool(!terminated));
        info.insert("failure", episode.failure.map_or(Value::Nil, |class| Value::text(class.name())));
        info.insert("episode", Value::Int(wanted.episode as i64));
        info.insert("steps", Value::Int(trial.steps as i64));
        info.insert("return", Value::Float(trial.reward));
        info.insert("hit_obstacle", Value::Bool(trial.hit_obstacle));
        answer.insert("info", info);
        answer
    }

    fn moment(&self, row: &[f32], reward: f64, conditions: &[bool], success: bool) -> (Value<'static>, Value<'_>) {
        let named = self.conditions.iter().zip(conditions);
        let conditions = named.map(|(name, holds)| (name.as_str().into(), Value::Bool(*holds))).collect();
        let info = Value::map([("success", Value::Bool(success)), ("conditions", Value::Map(conditions))]);
        let mut answer = Value::map([("observation", self.rows.observation(row))]);
        answer.insert("reward", Value::Float(reward));
        (answer, info)
    }
}
