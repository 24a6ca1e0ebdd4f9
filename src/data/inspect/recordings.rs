//! One recording, and a directory of them.

use super::{answer, by_entry, recording, statistics};
use crate::demo::{Episode, Phase, Step};
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use crate::state::{CONTROL_DT_S, State, action_names};
use crate::tasks::FailureClass;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::path::Path;

/// One episode.
pub(super) fn one(path: &Path) -> Result<Value> {
    let (episode, provenance) = recording::read(path)?;
    let states: Vec<f32> = moments(&episode).flat_map(|s| s.state.to_row()).collect();
    let actions = |pick: fn(&Step) -> &[f64; 9]| episode.steps.iter().flat_map(|s| pick(s).map(|v| v as f32)).collect::<Vec<_>>();
    let task = episode.scene.task;
    let rest = json!({
        "task": task,
        "episode": episode.index,
        "steps": episode.steps.len(),
        "duration_s": episode.steps.len() as f64 * CONTROL_DT_S,
        "success": episode.success,
        "failure": episode.failure.map(FailureClass::name),
        "reward": reward(&episode),
        "scene": episode.scene,
        "conditions": conditions(&episode),
        "phase_steps": phases(&episode),
        "contact_steps": contacts(&episode),
        "states": by_entry(&State::column_names(task), &states),
        "actions": by_entry(&action_names(), &actions(|s| &s.commanded)),
        "executed_actions": by_entry(&action_names(), &actions(|s| &s.executed)),
    });
    Ok(answer("recording", &provenance, rest))
}

/// All recordings in a directory.
pub(super) fn all(dir: &Path, interrupt: &Interrupt) -> Result<Value> {
    let files = recording::files(dir)?;
    if files.is_empty() {
        return Err(Error::input(dir, "is neither a dataset nor a directory of recordings (episode-00000.mcap, ...)"));
    }
    let (mut episodes, mut origin) = (Vec::new(), None);
    for file in &files {
        interrupt.check()?;
        let (episode, provenance) = recording::read(file)?;
        origin = Some(provenance);
        episodes.push(episode);
    }
    let origin = origin.expect("there is at least one recording");
    let mut failures: BTreeMap<&str, usize> = BTreeMap::new();
    for class in episodes.iter().filter_map(|e| e.failure) {
        *failures.entry(class.name()).or_default() += 1;
    }
    let failed: Vec<u64> = episodes.iter().filter(|e| !e.success).map(|e| e.index).collect();
    let hit = |e: &&Episode| e.steps.iter().chain([&e.last]).any(|s| s.contacts.robot_obstacle);
    let rest = json!({
        "task": origin.task,
        "episodes": episodes.len(),
        "episodes_with_obstacle_contact": episodes.iter().filter(hit).count(),
        "successes": episodes.len() - failed.len(),
        "failures": failures,
        "failed_episodes": failed,
        "steps": episodes.iter().map(|e| e.steps.len()).sum::<usize>(),
        "episode_steps": statistics(episodes.iter().map(|e| e.steps.len() as f64)),
        "episode_reward": statistics(episodes.iter().map(reward)),
    });
    Ok(answer("recordings", &origin, rest))
}

fn moments(episode: &Episode) -> impl Iterator<Item = &Step> {
    episode.steps.iter().chain([&episode.last])
}

fn reward(episode: &Episode) -> f64 {
    moments(episode).map(|s| s.reward).sum()
}

/// For each condition: at which step it first held, and whether it holds at the end.
fn conditions(episode: &Episode) -> Vec<Value> {
    let entry = |(i, name): (usize, &&str)| {
        let first = moments(episode).position(|s| s.conditions[i]);
        json!({ "name": name, "first_step": first, "at_end": episode.last.conditions[i] })
    };
    episode.scene.task.condition_names().iter().enumerate().map(entry).collect()
}

fn phases(episode: &Episode) -> Map<String, Value> {
    let count = |phase: Phase| episode.steps.iter().filter(|s| s.phase == Some(phase)).count();
    Phase::ALL.iter().map(|p| (p.name().to_string(), json!(count(*p)))).filter(|(_, n)| *n != json!(0)).collect()
}

fn contacts(episode: &Episode) -> Value {
    let count = |holds: fn(&Step) -> bool| moments(episode).filter(|s| holds(s)).count();
    json!({
        "finger_block": count(|s| s.contacts.finger_block_n.iter().any(|f| *f > 0.0)),
        "block_table": count(|s| s.contacts.block_table),
        "block_base": count(|s| s.contacts.block_base),
        "robot_obstacle": count(|s| s.contacts.robot_obstacle),
        "robot_table": count(|s| s.contacts.robot_table),
    })
}
