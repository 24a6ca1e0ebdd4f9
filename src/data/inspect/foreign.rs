//! A dataset of another program, described in the memory of one episode.

use super::statistics::{Columns, statistics};
use crate::data::dataset::foreign::{self, Choice, Root, described};
use crate::error::{Error, Result};
use serde_json::{Value, json};
use std::path::Path;

/// One root: what it says of itself, and the statistics of its states and actions, or why it cannot be learned from.
pub(super) fn one(path: &Path) -> Result<Value> {
    let root = Root::open(path)?;
    let mut found = described(&root)?;
    found["kind"] = json!("dataset of another program");
    found["episode_steps"] = json!(statistics(root.episodes.iter().map(|episode| episode.length as f64)));
    let source = match foreign::open(path, &Choice::default()) {
        Ok(source) => source,
        Err(Error::Input { message, .. }) => {
            found["learning"] = json!(format!("not as it is: it {message}"));
            return Ok(found);
        }
        Err(other) => return Err(other),
    };
    let layout = &source.layout;
    let [mut states, mut actions] = [Columns::NONE; 2];
    source.each_row(&mut |state, action| {
        states.add(state, layout.state_dim());
        actions.add(action, layout.action_dim());
    })?;
    source.each_row(&mut |state, action| {
        states.add_again(state);
        actions.add_again(action);
    })?;
    found["learning"] = json!(format!("states of {} numbers, actions of {}", layout.state_dim(), layout.action_dim()));
    found["states"] = json!(states.describe(&crate::data::dataset::names(&layout.state)));
    found["actions"] = json!(actions.describe(&crate::data::dataset::names(&layout.action)));
    Ok(found)
}
