//! What is allowed for the numbers of `[pretrain]` and `[train]`.

use super::scene::PulseSettings;
use crate::error::{Error, Result};

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

/// Strongest pulse that is no slip of the finger \[rad/s\], several times what the joints can do.
const MAX_PULSE_RAD_S: f64 = 10.0;

pub(super) fn pulses(key: &str, pulses: &PulseSettings) -> Result<()> {
    unit(&format!("{key}.probability"), pulses.probability)?;
    at_least_one(&format!("{key}.steps"), u64::from(pulses.steps))?;
    match pulses.sigma_rad_s {
        sigma if (0.0..=MAX_PULSE_RAD_S).contains(&sigma) => Ok(()),
        sigma => refuse(&format!("{key}.sigma_rad_s"), sigma, &format!("from 0 to {MAX_PULSE_RAD_S}")),
    }
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
