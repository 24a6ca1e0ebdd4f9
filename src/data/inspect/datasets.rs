//! A dataset, described in the memory of one of its files.

use super::{answer, statistics};
use crate::data::dataset;
use crate::error::{Error, Result};
use crate::state::{JOINTS, State, action_names};
use serde_json::{Map, Value, json};
use std::path::Path;

/// One root.
pub(super) fn one(root: &Path) -> Result<Value> {
    let (mut lengths, mut successes, mut sources) = (Vec::new(), 0, Vec::new());
    let [mut states, mut actions, mut executed] = [const { Columns::new() }; 3];
    let found = dataset::each(root, |episode| {
        lengths.push(episode.demo.len() as f64);
        successes += usize::from(episode.success);
        sources.push(episode.source_index);
        states.add(episode.demo.states(), episode.demo.task().state_dim());
        actions.add(episode.demo.actions(), JOINTS);
        executed.add(episode.demo.executed(), JOINTS);
    })?;
    // The squares of the distances from the means, which are known now.
    let again = dataset::each(root, |episode| {
        states.add_squares(episode.demo.states());
        actions.add_squares(episode.demo.actions());
        executed.add_squares(episode.demo.executed());
    })?;
    if again != found {
        return Err(Error::input(root, "changed while it was read; run hilt inspect again"));
    }
    let rest = json!({
        "task": found.task,
        "instruction": found.task.instruction(),
        "fps": found.fps,
        "episodes": lengths.len(),
        "frames": lengths.iter().sum::<f64>() as u64,
        "successes": successes,
        "episode_steps": statistics(lengths.iter().copied()),
        "source_episodes": sources,
        "states": states.describe(&State::column_names(found.task)),
        "actions": actions.describe(&action_names()),
        "executed_actions": executed.describe(&action_names()),
    });
    Ok(answer("dataset", &found.provenance, rest))
}

/// The statistics of [`super::by_entry`], of rows that come twice, some at a time.
struct Columns {
    rows: f64,
    entries: Vec<Entry>,
}

#[derive(Clone)]
struct Entry {
    sum: f64,
    min: f64,
    max: f64,
    squares: f64,
}

impl Columns {
    const fn new() -> Self {
        Columns { rows: 0.0, entries: Vec::new() }
    }

    /// Adds finite numbers, row-major.
    fn add(&mut self, rows: &[f32], width: usize) {
        // A sum of floats begins at -0.
        self.entries.resize(width, Entry { sum: -0.0, min: f64::INFINITY, max: f64::NEG_INFINITY, squares: -0.0 });
        for row in rows.chunks_exact(width) {
            self.rows += 1.0;
            for (entry, value) in self.entries.iter_mut().zip(row) {
                let value = f64::from(*value);
                entry.sum += value;
                (entry.min, entry.max) = (entry.min.min(value), entry.max.max(value));
            }
        }
    }

    /// The same numbers a second time.
    fn add_squares(&mut self, rows: &[f32]) {
        for row in rows.chunks_exact(self.entries.len()) {
            for (entry, value) in self.entries.iter_mut().zip(row) {
                entry.squares += (f64::from(*value) - entry.sum / self.rows).powi(2);
            }
        }
    }

    fn describe(&self, names: &[String]) -> Vec<Value> {
        let entry = |(name, entry): (&String, &Entry)| {
            let (mean, std) = (entry.sum / self.rows, (entry.squares / self.rows).sqrt());
            let numbers = [("min", entry.min), ("max", entry.max), ("mean", mean), ("std", std)];
            let mut fields = Map::from_iter(numbers.map(|(key, value)| (key.to_string(), json!(value))));
            fields.insert("name".into(), json!(name));
            Value::Object(fields)
        };
        names.iter().zip(&self.entries).map(entry).collect()
    }
}
