//! A dataset, described in the memory of one of its files.

use super::answer::answer;
use super::foreign;
use super::statistics::{Columns, statistics};
use crate::data::dataset;
use crate::data::dataset::foreign::{instructions, is_foreign};
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use serde_json::{Value, json};
use std::path::Path;

/// One root.
pub(super) fn one(root: &Path, interrupt: &Interrupt) -> Result<Value> {
    if is_foreign(root) {
        return foreign::one(root);
    }
    let (mut lengths, mut successes, mut sources) = (Vec::new(), 0, Vec::new());
    let [mut states, mut actions, mut executed] = [const { Columns::NONE }; 3];
    let found = dataset::each(root, |episode| {
        lengths.push(episode.demo.len() as f64);
        successes += usize::from(episode.success);
        sources.push(episode.source_index);
        states.add(episode.demo.states(), episode.demo.layout().state_dim());
        actions.add(episode.demo.actions(), episode.demo.layout().action_dim());
        executed.add(episode.demo.executed(), episode.demo.layout().action_dim());
        interrupt.check()
    })?;
    // The squares of the distances from the means, which are known now.
    let again = dataset::each(root, |episode| {
        states.add_again(episode.demo.states());
        actions.add_again(episode.demo.actions());
        executed.add_again(episode.demo.executed());
        interrupt.check()
    })?;
    if again != found {
        return Err(Error::input(root, "changed while it was read; run hilt inspect again"));
    }
    let rest = json!({
        "task": found.task,
        "instruction": instructions(root)?.first(),
        "fps": found.fps,
        "episodes": lengths.len(),
        "frames": lengths.iter().sum::<f64>() as u64,
        "successes": successes,
        "episode_steps": statistics(lengths.iter().copied()),
        "source_episodes": sources,
        "states": states.describe(&dataset::names(&found.layout.state)),
        "actions": actions.describe(&dataset::names(&found.layout.action)),
        "executed_actions": executed.describe(&dataset::names(&found.layout.action)),
    });
    Ok(answer("dataset", &found.provenance, rest))
}
