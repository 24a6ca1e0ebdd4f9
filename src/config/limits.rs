//! What `[pretrain]` and `[train]` are held to beyond the range of each number.

use super::check::leaves;
use super::ranges::Range;
use crate::error::{Error, Result};
use serde::Serialize;
use toml::{Table, Value};

pub(super) fn refuse(key: &str, value: impl std::fmt::Display, allowed: &str) -> Result<()> {
    Err(Error::Usage(format!("{key} = {value} is not allowed; it must be {allowed}")))
}

/// Every number of a section within its range.
pub(super) fn within_ranges(section: &str, settings: &impl Serialize) -> Result<()> {
    let table = Table::try_from(settings).map_err(|e| Error::Usage(format!("[{section}] cannot be written as TOML: {e}")))?;
    let whole = Table::from_iter([(section.to_string(), Value::Table(table))]);
    leaves(&whole).iter().try_for_each(|(key, value)| match Range::of(key) {
        Some(range) if !range.holds(value) => refuse(key, value, &range.must_be()),
        _ => Ok(()),
    })
}

/// All weights of a stage's networks together: learning keeps some twenty arrays of that length, 400 MB.
const MOST_WEIGHTS: usize = 5_000_000;

/// The hidden layers of `count` networks; inputs and outputs add little.
pub(super) fn network(stage: &str, layers: usize, units: usize) -> Result<()> {
    let weights = (layers - 1) * units * units;
    if weights <= MOST_WEIGHTS {
        return Ok(());
    }
    let key = format!("{stage}.hidden_layers = {layers} with {stage}.hidden_units = {units}");
    Err(Error::Usage(format!("{key} is not allowed: {weights} weights between hidden layers, {MOST_WEIGHTS} are the most")))
}
