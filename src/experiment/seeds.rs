//! Seeds of an experiment: a list, or a text such as `0-4,9`.

use crate::words::shown;
use serde::Deserialize;

/// More seeds than anyone runs on one machine; a slip such as `0-99999999` ends here.
const MOST_SEEDS: u64 = 10_000;

/// Seeds as a file gives them.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(untagged, expecting = "expected a text such as \"0-4,9\", or a list such as [0, 1, 4]")]
pub enum Seeds {
    /// One by one.
    List(Vec<u64>),
    /// As [`seeds_of`] reads it.
    Text(String),
}

impl Seeds {
    /// The seeds, in the order given.
    ///
    /// # Errors
    /// What is wrong, in words.
    pub fn all(&self) -> Result<Vec<u64>, String> {
        match self {
            Seeds::Text(text) => seeds_of(text),
            Seeds::List(list) => check(list.clone()),
        }
    }
}

/// The seeds of a text: numbers and ranges (both ends included), separated by commas.
///
/// # Errors
/// What is wrong, in words.
pub fn seeds_of(text: &str) -> Result<Vec<u64>, String> {
    let wrong = || format!("seeds \"{}\" are no list of numbers and ranges such as 0-4,9", shown(text));
    let number = |word: &str| word.trim().parse::<u64>().map_err(|_| wrong());
    let mut seeds = Vec::new();
    for part in text.split(',') {
        let (first, last) = match part.split_once('-') {
            Some((first, last)) => (number(first)?, number(last)?),
            None => (number(part)?, number(part)?),
        };
        if last < first {
            return Err(format!("seeds {first}-{last}: the lower end comes first"));
        }
        if last - first >= MOST_SEEDS {
            return Err(format!("seeds {first}-{last} are more than {MOST_SEEDS}, the most that are allowed"));
        }
        seeds.extend(first..=last);
    }
    check(seeds)
}

fn check(seeds: Vec<u64>) -> Result<Vec<u64>, String> {
    let mut sorted = seeds.clone();
    sorted.sort_unstable();
    if let Some(twice) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(format!("seed {} is there twice", twice[0]));
    }
    if seeds.len() as u64 > MOST_SEEDS {
        return Err(format!("{} seeds; allowed: up to {MOST_SEEDS}", seeds.len()));
    }
    Ok(seeds)
}
