//! New datasets out of others, hilt's own or not: split, filtered, merged, without columns, or with narrower numbers. Episodes stream from the
//! one to the other; statistics are worked out anew. What was hilt's own and still has all that makes it so stays it, and says what was done.

mod input;
mod rewrite;

pub use input::Input;
pub use rewrite::{Part, Plan, write};

use crate::words::shown;
use std::collections::{BTreeSet, HashMap};

/// Most numbers that a list of episodes may name.
const MOST_NAMED: usize = 1_000_000;

/// Numbers of episodes: `0-9,12`.
///
/// # Errors
/// What cannot be read, and what is expected.
pub fn episodes_of(text: &str) -> Result<BTreeSet<usize>, String> {
    let wrong = || format!("\"{}\" is no list of numbers and ranges such as 0-9,12", shown(text));
    let mut found = BTreeSet::new();
    for part in text.split(',') {
        let (from, to) = part.split_once('-').unwrap_or((part, part));
        let number = |text: &str| text.trim().parse::<usize>().map_err(|_| wrong());
        let (from, to) = (number(from)?, number(to)?);
        if from > to || to - from >= MOST_NAMED {
            return Err(wrong());
        }
        found.extend(from..=to);
    }
    Ok(found)
}

/// Whether every dataset has this column.
pub fn is_usual(column: &str) -> bool {
    input::USUAL.iter().any(|(name, _)| *name == column)
}

/// The first two inputs of the same content, by their places.
pub fn same_twice(inputs: &[Input]) -> Option<(usize, usize)> {
    let mut seen = HashMap::new();
    inputs.iter().enumerate().find_map(|(at, input)| Some((seen.insert(input.content.to_string(), at)?, at)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_episodes() {
        assert_eq!(episodes_of("3, 0-2,3").expect("a list"), BTreeSet::from([0, 1, 2, 3]));
        for wrong in ["", "a", "3-1", "-1", "1-", "0-99999999999", "1,,2"] {
            assert!(episodes_of(wrong).expect_err(wrong).contains("such as 0-9,12"));
        }
    }
}
