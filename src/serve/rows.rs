//! Rows of states under the names that LeRobot gives their parts.

use super::value::Value;
use crate::config::MOST_STEPS;
use crate::demo::LARGEST_NUMBER;
use crate::layout::{Layout, Span};
use serde_json::{Value as Json, json};
use std::sync::Arc;

/// The robot's own part of a state row: joint positions, then velocities.
pub const STATE: &str = "observation.state";
/// The rest of it: poses of objects, goals.
pub const ENVIRONMENT: &str = "observation.environment_state";
/// A whole state row.
pub const WHOLE: &str = "state";
/// Number of a control step in its episode; 0 begins a new one.
pub const FRAME: &str = "frame_index";
/// Number of an episode.
pub const EPISODE: &str = "episode_index";

/// The longest episode that is run: the longest horizon of a policy.
pub const MOST_HORIZON_STEPS: u32 = 2 * MOST_STEPS;

/// Takes rows apart and puts them together.
#[derive(Clone, Debug)]
pub struct Rows {
    layout: Arc<Layout>,
    own: usize,
}

impl Rows {
    /// Of this layout.
    pub fn new(layout: &Arc<Layout>) -> Self {
        Rows { layout: Arc::clone(layout), own: layout.proprioception() }
    }

    /// What the entries hold.
    pub fn layout(&self) -> &Arc<Layout> {
        &self.layout
    }

    /// A row in its two parts.
    pub fn observation(&self, row: &[f32]) -> Value<'static> {
        let (own, rest) = row.split_at(self.own);
        let part = |numbers: &[f32]| Value::Array(super::array::Array::f32(&[numbers.len()], numbers));
        let mut map = Value::map([(STATE, part(own))]);
        if !rest.is_empty() {
            map.insert(ENVIRONMENT, part(rest));
        }
        map
    }

    /// The row that an observation has: whole under `state`, or in two parts. Without velocities where they are not `needed`; they are zero then.
    ///
    /// # Errors
    /// Says which keys there are, which must be, and of how many numbers.
    pub fn row(&self, observation: &Value, needed: bool) -> Result<Vec<f32>, String> {
        let (dim, velocities) = (self.layout.state_dim(), self.layout.velocities());
        let row = if let Some(whole) = observation.get(WHOLE) {
            vector(WHOLE, whole, &[dim])?
        } else {
            let Some(own) = observation.get(STATE) else { return Err(self.missing(observation, STATE)) };
            let bare = self.own - velocities.len();
            let allowed = [self.own, bare];
            let mut row = vector(STATE, own, if needed { &allowed[..1] } else { &allowed })?;
            if row.len() == bare {
                row.splice(velocities.start..velocities.start, vec![0.0; velocities.len()]);
            }
            if dim > self.own {
                let Some(rest) = observation.get(ENVIRONMENT) else { return Err(self.missing(observation, ENVIRONMENT)) };
                row.extend(vector(ENVIRONMENT, rest, &[dim - self.own])?);
            }
            row
        };
        let names = || self.layout.state.iter().flat_map(|span| &span.entries);
        let possible = |v: f32| v.is_finite() && f64::from(v.abs()) <= LARGEST_NUMBER;
        match row.iter().zip(names()).find(|(v, _)| !possible(**v)) {
            Some((value, name)) => Err(format!("{name} is {value}; it must be a number within {LARGEST_NUMBER:e} either way")),
            None => Ok(row),
        }
    }

    fn missing(&self, observation: &Value, key: &str) -> String {
        let keys: Vec<&str> = match observation {
            Value::Map(entries) => entries.iter().map(|(name, _)| name.as_ref()).take(20).collect(),
            _ => vec![],
        };
        let (own, rest) = (self.own, self.layout.state_dim() - self.own);
        format!(
            "no \"{key}\" among the keys {keys:?}; an observation has \"{STATE}\" ({own} numbers) and \"{ENVIRONMENT}\" ({rest})"
        )
    }

    /// The names of the keys' entries, as metadata have them.
    pub fn keys(&self) -> Json {
        let names: Vec<&str> = self.layout.state.iter().flat_map(|span| &span.entries).map(String::as_str).collect();
        let (own, rest) = names.split_at(self.own);
        json!({ STATE: own, ENVIRONMENT: rest })
    }

    /// Names of an action's entries.
    pub fn actions(&self) -> Vec<&str> {
        self.layout.action.iter().flat_map(|span: &Span| &span.entries).map(String::as_str).collect()
    }
}

/// One row of a length that is allowed.
fn vector(name: &str, value: &Value, allowed: &[usize]) -> Result<Vec<f32>, String> {
    let numbers = value.numbers().map_err(|why| format!("\"{name}\" holds {why}"))?;
    let (shape, last) = (numbers.shape.clone(), numbers.shape.last().copied().unwrap_or(0));
    let rows = allowed.contains(&last).then(|| numbers.rows(last)).flatten();
    match rows.map(|mut rows| (rows.len(), rows.remove(0))) {
        Some((1, row)) => Ok(row),
        _ => Err(format!("\"{name}\" has shape {shape:?}; it must be one row of {} numbers", allowed[0])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::file::built_in::paper_robot;
    use crate::task::built_in::stack;

    #[test]
    fn a_row_comes_back_from_its_parts_and_whole() {
        let rows = Rows::new(&stack().layout(&paper_robot()));
        let row: Vec<f32> = (0..32).map(|i| i as f32 * 0.25).collect();
        let parts = rows.observation(&row);
        assert_eq!(rows.row(&parts, true).as_ref(), Ok(&row));
        let json = json!({ WHOLE: [row] });
        assert_eq!(rows.row(&Value::of_json(&json), true).as_ref(), Ok(&row));
        let bare = json!({ STATE: row[..9], ENVIRONMENT: row[18..] });
        assert!(rows.row(&Value::of_json(&bare), true).is_err_and(|why| why.contains("18 numbers")));
        let filled = rows.row(&Value::of_json(&bare), false).expect("velocities are not needed");
        assert_eq!((&filled[..9], &filled[9..18], &filled[18..]), (&row[..9], &[0.0; 9][..], &row[18..]));
    }

    #[test]
    fn what_is_no_observation_is_said() {
        let rows = Rows::new(&stack().layout(&paper_robot()));
        let whole = vec![0.0; 32];
        let mut broken = whole.clone();
        broken[2] = 1e7;
        for (json, said) in [
            (json!({ "image": 1 }), "no \"observation.state\" among the keys [\"image\"]"),
            (json!({ STATE: whole[..18] }), "no \"observation.environment_state\""),
            (json!({ STATE: whole[..17], ENVIRONMENT: whole[..14] }), "shape [17]; it must be one row of 18 numbers"),
            (json!({ WHOLE: [whole, whole] }), "shape [2, 32]"),
            (json!({ WHOLE: "x" }), "\"state\" holds text instead of numbers"),
            (json!({ WHOLE: [] }), "shape [0]"),
            (json!({ WHOLE: broken }), "q_rad is 10000000"),
            (json!({ WHOLE: vec![None::<f32>; 32] }), "q_rad is NaN"),
        ] {
            let why = rows.row(&Value::of_json(&json), true).expect_err(said);
            assert!(why.contains(said), "{why}");
        }
    }
}
