//! Which compilation of the kernel runs.

use super::path::{Path, VARIABLE};
use super::trial;
use crate::error::Result;
use std::sync::OnceLock;

/// The one that runs in this process.
static CHOSEN: OnceLock<Path> = OnceLock::new();

/// Lets the environment variable `HILT_KERNEL` (`avx512`, `avx512vl`, `avx2` or `portable`) choose the kernel, for tests and measurements.
/// Without it the fastest one that the processor has runs, found by a trial of a millisecond. To be called before the first product.
///
/// # Errors
/// [`crate::error::Error::Usage`] when the value is no kernel, or one that this processor lacks.
pub fn choose() -> Result<()> {
    if let Some(name) = std::env::var_os(VARIABLE) {
        let path = Path::named(&name)?;
        CHOSEN.get_or_init(|| path);
    }
    Ok(())
}

/// The kernel that runs, and how fast those that could are here, for who asks a program what it is.
pub fn describe() -> String {
    let trials: Vec<String> = trial::rates().iter().map(|(path, rate)| format!("{} {:.0}", path.name(), rate / 1e9)).collect();
    let speeds =
        if trials.is_empty() { String::new() } else { format!(" (GFLOP/s of a core, in a short trial: {})", trials.join(", ")) };
    format!("{}{speeds}", best().name())
}

/// The one that runs: the fastest, unless [`choose`] chose another.
pub fn best() -> Path {
    *CHOSEN.get_or_init(trial::fastest)
}
