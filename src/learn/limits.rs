//! What learning refuses before it takes all memory, and what it says when a loss is no number from the beginning.

use crate::error::{Error, Result};

/// A loss that is no number although nothing was learned yet: no learning rate is to blame.
pub(super) fn before_the_first_update(term: &str, value: f64, settings: &str) -> String {
    format!(
        "{term} is {value} before the first update: look at the demos (`hilt inspect` shows the range of each entry), {settings}"
    )
}

/// Numbers between the layers of a network in one update: with their gradients 4 GB. Settings come to so many only by a slip.
const MOST_ACTIVATIONS: usize = 500_000_000;

/// Refuses an update of `rows` rows that would take all memory; `keys` say what to lower.
///
/// # Errors
/// [`Error::Usage`] with the numbers.
pub(super) fn affordable(rows: usize, layers: usize, units: usize, keys: &str) -> Result<()> {
    if rows.saturating_mul(layers * units) <= MOST_ACTIVATIONS {
        return Ok(());
    }
    Err(Error::Usage(format!(
        "an update of {rows} rows through {layers} layers of {units} units is more than memory holds: rows x layers x units may be \
         {MOST_ACTIVATIONS}; lower {keys}"
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_update_that_memory_cannot_hold_is_refused() {
        assert!(affordable(8 * 400, 3, 100, "train.batch").is_ok());
        let said = affordable(1_000_000, 16, 512, "train.bc_batch").expect_err("64 GB").to_string();
        assert!(said.contains("1000000 rows") && said.contains("lower train.bc_batch"), "{said}");
        assert!(affordable(usize::MAX, 16, 512, "").is_err());
    }
}
