//! A few of the mutated inputs that `make fuzz` gives to every reader of files: none of them panics.

#[path = "../benches/fuzz/mutate.rs"]
mod mutate;
#[path = "../benches/fuzz/readers.rs"]
mod readers;
#[path = "../benches/fuzz/recordings.rs"]
mod recordings;
#[path = "../benches/fuzz/sources.rs"]
mod sources;
#[path = "../benches/fuzz/structure.rs"]
mod structure;

use readers::{NAMES, Reader, Verdict};

/// Inputs of each reader.
const INPUTS: u64 = 300;

#[test]
fn no_reader_panics_on_mutated_files_behind_a_valid_seal() {
    let dir = tempfile::tempdir().expect("dir");
    for name in NAMES {
        let mut reader = Reader::new(name, &dir.path().join(name), 1);
        let verdicts: Vec<Verdict> = (0..INPUTS)
            .map(|number| {
                let input = reader.input(number);
                reader.read(&input, number)
            })
            .collect();
        let panicked = verdicts.iter().position(|verdict| matches!(verdict, Verdict::Panicked));
        assert_eq!(panicked, None, "{name}: the input that panicked");
        let refused = verdicts.iter().filter(|verdict| matches!(verdict, Verdict::Refused(_))).count();
        assert!(refused > 0 && refused < verdicts.len(), "{name}: {refused} of {INPUTS} refused, no seal was right");
    }
}

#[test]
fn an_input_is_the_same_every_time() {
    let dir = tempfile::tempdir().expect("dir");
    for name in NAMES {
        let [one, other] = ["one", "other"].map(|place| Reader::new(name, &dir.path().join(name).join(place), 1));
        assert!((0..20).all(|number| one.input(number) == other.input(number)), "{name}");
    }
}
