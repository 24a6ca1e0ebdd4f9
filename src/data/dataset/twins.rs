//! Episodes that are there twice. In training and in validation they make a validation loss that says nothing.

use crate::demo::Demo;
use std::collections::HashMap;

/// What names a demo's content: a hash of its numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Fingerprint(blake3::Hash);

impl Fingerprint {
    /// Of all its states and actions.
    pub fn of(demo: &Demo) -> Self {
        let mut hash = blake3::Hasher::new();
        for numbers in [demo.states(), demo.actions(), demo.executed()] {
            hash.update(&(numbers.len() as u64).to_le_bytes());
            for number in numbers {
                hash.update(&number.to_le_bytes());
            }
        }
        Fingerprint(hash.finalize())
    }
}

/// The first two that are the same in every number, by their positions.
pub fn first_twins(demos: impl IntoIterator<Item = Fingerprint>) -> Option<(usize, usize)> {
    let mut seen = HashMap::new();
    demos.into_iter().enumerate().find_map(|(at, demo)| Some((seen.insert(demo, at)?, at)))
}

/// The first demo of `training` that stands in `validation` too, by their positions.
pub fn first_shared(training: &[Demo], validation: &[Demo]) -> Option<(usize, usize)> {
    let seen: HashMap<_, _> = validation.iter().enumerate().map(|(at, demo)| (Fingerprint::of(demo), at)).collect();
    training.iter().enumerate().find_map(|(at, demo)| Some((at, *seen.get(&Fingerprint::of(demo))?)))
}
