//! What is allowed for the numbers of `[pretrain]` and `[train]`.

use super::ranges::Range;
use super::scene::PulseSettings;
use crate::error::{Error, Result};
use toml::Value;

pub(super) fn refuse(key: &str, value: impl std::fmt::Display, allowed: &str) -> Result<()> {
    Err(Error::Usage(format!("{key} = {value} is not allowed; it must be {allowed}")))
}

pub(super) fn unit(key: &str, value: f64) -> Result<()> {
    if (0.0..=1.0).contains(&value) { Ok(()) } else { refuse(key, value, "between 0 and 1") }
}

pub(super) fn positive(key: &str, value: f64) -> Result<()> {
    if value > 0.0 && value.is_finite() { Ok(()) } else { refuse(key, value, "above 0 and finite") }
}

pub(super) fn at_least_one(key: &str, value: u64) -> Result<()> {
    if value >= 1 { Ok(()) } else { refuse(key, value, "at least 1") }
}

/// Pulses have the ranges of `[simulate.pulses]`, wherever they stand.
pub(super) fn pulses(key: &str, pulses: &PulseSettings) -> Result<()> {
    let PulseSettings { probability, steps, sigma_rad_s } = pulses;
    let entries =
        [("probability", Value::from(*probability)), ("steps", i64::from(*steps).into()), ("sigma_rad_s", (*sigma_rad_s).into())];
    entries.iter().try_for_each(|(name, value)| {
        let range = Range::of(&format!("simulate.pulses.{name}")).expect("every number of a pulse has a range");
        range.check(&format!("{key}.{name}"), value).map_err(Error::Usage)
    })
}

/// Beyond these a network is a typing error.
const MAX_LAYERS: usize = 16;
const MAX_UNITS: usize = 4096;

pub(super) fn network(stage: &str, layers: usize, units: usize) -> Result<()> {
    if !(1..=MAX_LAYERS).contains(&layers) {
        return refuse(&format!("{stage}.hidden_layers"), layers, &format!("from 1 to {MAX_LAYERS}"));
    }
    if !(1..=MAX_UNITS).contains(&units) {
        return refuse(&format!("{stage}.hidden_units"), units, &format!("from 1 to {MAX_UNITS}"));
    }
    Ok(())
}

pub(super) fn optimiser(stage: &str, clip_norm: f64, ema_decay: f64) -> Result<()> {
    if !(clip_norm >= 0.0 && clip_norm.is_finite()) {
        return refuse(&format!("{stage}.clip_norm"), clip_norm, "0 (no limit) or above");
    }
    if !(0.0..1.0).contains(&ema_decay) {
        return refuse(&format!("{stage}.ema_decay"), ema_decay, "at least 0 and below 1");
    }
    Ok(())
}
