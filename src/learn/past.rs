//! What a checkpoint says of the past, held against what training can have made: its seal is a checksum that anybody can compute.

use super::checkpoint::{Counts, History};
use super::metrics::{EpochMetrics, HIL, WARM_START};

/// Most updates of a run: `train.warm_start_updates` and `train.min_updates` are allowed ten million each, epochs over the most demos
/// ten thousand times as many.
const MOST_UPDATES: u64 = 1_000_000_000_000;
/// Most steps of an optimiser, which counts them in 32 bits.
const MOST_STEPS: u32 = 1 << 31;
/// Most episodes that candidates are rolled out on, as `train.select_episodes` is allowed.
const MOST_EPISODES: u64 = 100_000;
/// The logarithm of a ratio of two positive numbers of double precision is no longer.
const LARGEST_LOG: f64 = 1500.0;

/// Refuses counts, epochs and candidates that no run leaves behind.
///
/// # Errors
/// Says which number is out of its limits.
pub(super) fn check(counts: &Counts, history: &History) -> Result<(), String> {
    let Some(last) = history.rows.last() else { return Err("it holds no epoch".into()) };
    let before = [None].into_iter().chain(history.rows.iter().map(Some));
    before.zip(&history.rows).try_for_each(|(before, row)| follows(before, row))?;
    if (counts.updates, counts.skipped) != (last.updates, last.skipped) {
        let (updates, skipped, place) = (counts.updates, counts.skipped, last.place());
        return Err(format!(
            "it counts {updates} updates and {skipped} left out, its {place} {} and {}",
            last.updates, last.skipped
        ));
    }
    at_most("draws", counts.draws, MOST_UPDATES)?;
    for steps in [counts.net, counts.std] {
        at_most("steps of an optimiser", steps.adam, MOST_STEPS)?;
        at_most("steps of an average", steps.ema, MOST_STEPS)?;
    }
    let adams = counts.model_adam.iter().flatten();
    adams.copied().try_for_each(|steps| at_most("steps of an optimiser", steps, MOST_STEPS))?;
    let (d_conv, log_ratio) = counts.averages.known();
    within("average of d_conv", d_conv, 0.0, 1.0)?;
    within("average of the gradients' ratio", log_ratio, -LARGEST_LOG, LARGEST_LOG)?;
    candidates(history)
}

/// Epochs come one after another, the warm start's before those of Algorithm 1.
fn follows(before: Option<&EpochMetrics>, row: &EpochMetrics) -> Result<(), String> {
    let begins = row.epoch == 1 && before.is_none_or(|b| (b.stage, row.stage) == (WARM_START, HIL));
    let goes_on = before.is_some_and(|b| {
        (b.stage, b.epochs) == (row.stage, row.epochs) && b.epoch.checked_add(1) == Some(row.epoch) && b.updates <= row.updates
    });
    let skips_more = before.is_none_or(|b| b.skipped <= row.skipped);
    let known = [WARM_START, HIL].contains(&row.stage) && row.epoch <= row.epochs;
    if !(known && (begins || goes_on) && skips_more) {
        let stood = before.map_or("the beginning".into(), EpochMetrics::place);
        return Err(format!("{} cannot come after {stood}", row.place()));
    }
    at_most("updates", row.updates, MOST_UPDATES)?;
    at_most("updates left out", row.skipped, MOST_UPDATES)?;
    at_most("epochs of a stage", row.epochs, MOST_UPDATES)
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

fn at_most<T: PartialOrd + std::fmt::Display>(what: &str, value: T, most: T) -> Result<(), String> {
    if value <= most { Ok(()) } else { Err(format!("{what}: {value}, at most {most} are possible")) }
}

fn within(what: &str, value: Option<f64>, low: f64, high: f64) -> Result<(), String> {
    match value {
        Some(value) if !(low..=high).contains(&value) => Err(format!("{what}: {value}, it lies from {low} to {high}")),
        _ => Ok(()),
    }
}
