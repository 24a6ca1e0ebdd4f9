//! Rows of states under the names that LeRobot gives their parts, or under those of the columns that a policy has learned from.

use super::value::Value;
use crate::demo::LARGEST_NUMBER;
use crate::layout::{Layout, Span};
use serde_json::{Map, Value as Json};
use std::borrow::Cow;
use std::ops::Range;
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

/// Takes rows apart and puts them together.
#[derive(Clone, Debug)]
pub struct Rows {
    layout: Arc<Layout>,
    /// The parts that an observation has, in the order of the row.
    parts: Vec<(String, Range<usize>)>,
}

/// The robot's own part and the rest; where nothing is known of joints, a part for each column of the dataset.
fn parts(layout: &Layout) -> Vec<(String, Range<usize>)> {
    let (own, dim) = (layout.proprioception(), layout.state_dim());
    if own == 0 {
        return layout.state_spans().map(|(span, at)| (span.name.clone(), at)).collect();
    }
    let parts = [(STATE.to_string(), 0..own), (ENVIRONMENT.to_string(), own..dim)];
    parts.into_iter().filter(|(_, entries)| !entries.is_empty()).collect()
}

impl Rows {
    /// Of this layout.
    pub fn new(layout: &Arc<Layout>) -> Self {
        Rows { layout: Arc::clone(layout), parts: parts(layout) }
    }

    /// What the entries hold.
    pub fn layout(&self) -> &Arc<Layout> {
        &self.layout
    }

    /// A row in its parts.
    pub fn observation(&self, row: &[f32]) -> Value<'static> {
        let part = |(key, entries): &(String, Range<usize>)| {
            let numbers = &row[entries.clone()];
            (Cow::Owned(key.clone()), Value::Array(super::array::Array::f32(&[numbers.len()], numbers)))
        };
        Value::Map(self.parts.iter().map(part).collect())
    }

    /// The row that an observation has: whole under `state`, or in its parts. Without velocities where they are not `needed`; they are zero then.
    ///
    /// # Errors
    /// Says which keys there are, which must be, and of how many numbers.
    pub fn row(&self, observation: &Value, needed: bool) -> Result<Vec<f32>, String> {
        let (dim, velocities) = (self.layout.state_dim(), self.layout.velocities());
        let row = if let Some(whole) = observation.get(WHOLE) {
            vector(WHOLE, whole, &[dim])?
        } else {
            let mut row = Vec::with_capacity(dim);
            for (key, entries) in &self.parts {
                let Some(part) = observation.get(key) else { return Err(self.missing(observation, key)) };
                let left_out = if needed || !entries.contains(&velocities.start) { 0 } else { velocities.len() };
                let allowed = [entries.len(), entries.len() - left_out];
                let part = vector(key, part, if left_out == 0 { &allowed[..1] } else { &allowed })?;
                let is_bare = part.len() < entries.len();
                row.extend(part);
                if is_bare {
                    row.splice(velocities.start..velocities.start, vec![0.0; velocities.len()]);
                }
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
        let parts = self.parts.iter().map(|(name, entries)| format!("\"{name}\" ({} numbers)", entries.len()));
        format!("no \"{key}\" among the keys {keys:?}; an observation has {}", parts.collect::<Vec<_>>().join(" and "))
    }

    /// The names of the keys' entries, as metadata have them.
    pub fn keys(&self) -> Json {
        let names: Vec<&str> = self.layout.state.iter().flat_map(|span| &span.entries).map(String::as_str).collect();
        Json::Object(self.parts.iter().map(|(key, entries)| (key.clone(), names[entries.clone()].into())).collect::<Map<_, _>>())
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
    use crate::layout::Holds;
    use crate::robot::file::built_in::paper_robot;
    use crate::task::built_in::stack;
    use serde_json::json;

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

    /// The rows of a dataset that says nothing of joints.
    #[test]
    fn columns_of_a_dataset_are_the_parts_of_its_rows() {
        let span = |name: &str, width: usize, holds| Span {
            name: name.into(),
            holds,
            entries: (0..width).map(|i| format!("{name}.{i}")).collect(),
        };
        let layout = Layout {
            state: vec![span("observation.state", 3, Holds::Numbers), span("observation.force", 2, Holds::Numbers)],
            action: vec![span("action", 2, Holds::Commands)],
            action_limits: Vec::new(),
            aims: Vec::new(),
            arm: None,
            ..(*stack().layout(&paper_robot())).clone()
        };
        let rows = Rows::new(&Arc::new(layout));
        let observation = json!({ "observation.force": [4, 5], "observation.state": [1, 2, 3], "prompt": "x" });
        let row = rows.row(&Value::of_json(&observation), false).expect("an observation");
        assert_eq!(row, [1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(rows.keys()["observation.force"], json!(["observation.force.0", "observation.force.1"]));
        let why = rows.row(&Value::of_json(&json!({ "observation.state": [1, 2, 3] })), true).expect_err("a column is missing");
        assert!(why.contains("\"observation.state\" (3 numbers) and \"observation.force\" (2 numbers)"), "{why}");
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
