//! What a checkpoint says of the past, held against what training can have made: its seal is a checksum that anybody can compute.

use super::history::History;
use super::method::Stage;
use super::metrics::EpochMetrics;

/// Most updates of a run: `train.warm_start_updates` and `train.min_updates` are allowed ten million each, epochs over the most demos
/// ten thousand times as many.
pub const MOST_UPDATES: u64 = 1_000_000_000_000;
/// Most episodes that candidates are rolled out on, as `train.select_episodes` is allowed.
const MOST_EPISODES: u64 = 100_000;

/// Refuses epochs and candidates that no run of these stages leaves behind.
///
/// # Errors
/// Says which number is out of its limits.
pub fn check(history: &History, stages: &[Stage]) -> Result<(), String> {
    if history.rows.is_empty() {
        return Err("it holds no epoch".into());
    }
    let before = [None].into_iter().chain(history.rows.iter().map(Some));
    before.zip(&history.rows).try_for_each(|(before, row)| follows(before, row, stages))?;
    candidates(history)
}

/// Epochs come one after another, those of a stage after those of the stage before.
fn follows(before: Option<&EpochMetrics>, row: &EpochMetrics, stages: &[Stage]) -> Result<(), String> {
    let place = |row: &EpochMetrics| stages.iter().filter(|s| s.epochs > 0).position(|stage| stage.name == row.stage);
    let stage = stages.iter().find(|stage| stage.name == row.stage);
    let known = stage.is_some_and(|stage| (1..=stage.epochs).contains(&row.epoch) && row.epochs == stage.epochs);
    let goes_on = match before {
        None => row.epoch == 1 && place(row) == Some(0),
        Some(b) if b.stage == row.stage => b.epoch.checked_add(1) == Some(row.epoch) && b.updates <= row.updates,
        Some(b) => row.epoch == 1 && b.epoch == b.epochs && place(row) == place(b).map(|at| at + 1),
    };
    if !(known && goes_on) {
        let stood = before.map_or("the beginning".into(), EpochMetrics::place);
        return Err(format!("{} cannot come after {stood}", row.place()));
    }
    at_most("updates", row.updates, MOST_UPDATES)
}

/// The chosen candidate is one of them, and none solved more episodes than there can be.
fn candidates(history: &History) -> Result<(), String> {
    let (chosen, candidates) = (history.selection.chosen, &history.selection.candidates);
    if chosen >= candidates.len().max(1) {
        return Err(format!("it chose candidate {chosen} of {}", candidates.len()));
    }
    if candidates.len() > history.rows.len() {
        return Err(format!("it has {} candidates after {} epochs", candidates.len(), history.rows.len()));
    }
    candidates.iter().try_for_each(|c| at_most("successes of a candidate", c.successes, MOST_EPISODES))
}

/// Refuses more than can be.
///
/// # Errors
/// Says the value and the limit.
pub fn at_most<T: PartialOrd + std::fmt::Display>(what: &str, value: T, most: T) -> Result<(), String> {
    if value <= most { Ok(()) } else { Err(format!("{what}: {value}, at most {most} are possible")) }
}

/// Refuses what lies outside of its limits.
///
/// # Errors
/// Says the value and the limits.
pub fn within(what: &str, value: Option<f64>, low: f64, high: f64) -> Result<(), String> {
    match value {
        Some(value) if !(low..=high).contains(&value) => Err(format!("{what}: {value}, it lies from {low} to {high}")),
        _ => Ok(()),
    }
}
