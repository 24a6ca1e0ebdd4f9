//! Training that stops and goes on; checkpoints that cannot be used; what training says of losses and datasets that cannot work.

use crate::interrupted::{signal, start};
use crate::runs::{Run, contents, hilt, text};
use hilt::data::weights;
use std::fs;
use std::process::Output;
use std::time::{Duration, Instant};

const CHECKPOINT: &str = "policy.checkpoint.safetensors";
/// A few seconds of training in both stages, in short epochs.
const LONG: [&str; 3] = ["train.bc_batch=64", "train.warm_start_updates=8000", "train.epochs=600"];
/// Training that fails in the first epochs of Algorithm 1.
const DIVERGING: [&str; 2] = ["train.learning_rate=1e30", "train.clip_norm=0.0"];
/// For a busy machine.
const PATIENCE: Duration = Duration::from_secs(120);

/// The arguments of training with these settings and further words.
fn training(run: &Run, sets: &[&str], further: &[&str]) -> Vec<String> {
    let sets = sets.iter().flat_map(|set| ["--set".to_string(), set.to_string()]);
    run.words("train").into_iter().chain(sets).chain(further.iter().map(|w| w.to_string())).collect()
}

/// Starts training, sends the signal as soon as `ready` says so.
fn stopped(words: Vec<String>, name: &str, ready: impl Fn() -> bool) -> Output {
    let child = start(words);
    let started = Instant::now();
    while !ready() {
        assert!(started.elapsed() < PATIENCE, "training has not come so far");
        std::thread::sleep(Duration::from_millis(2));
    }
    signal(&child, name);
    child.wait_with_output().expect("ended")
}

fn done(words: Vec<String>) -> String {
    let output = hilt(words);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    text(&output.stderr)
}

fn results(run: &Run) -> [Vec<u8>; 2] {
    ["policy.safetensors", "policy.training.parquet"].map(|name| fs::read(run.at(name)).expect("a result"))
}

#[test]
fn interrupted_twice_training_ends_with_the_same_bytes() {
    let (whole, run) = (Run::finished(), Run::finished());
    done(training(&whole, &LONG, &[]));
    let (before, log) = (contents(run.path()), run.name("train.log"));
    let seen = |mark: &str| fs::read_to_string(&log).unwrap_or_default().contains(mark);

    for (further, mark) in [(&["--checkpoint-every", "0"][..], "warm-start: "), (&["--resume", "--threads", "1"], "hil: ")] {
        let words = training(&run, &LONG, &[further, &["--log", &log]].concat());
        let output = stopped(words, "INT", || seen(mark));
        let (stage, stderr) = (mark.trim_end_matches(": "), text(&output.stderr));
        assert_eq!(output.status.code(), Some(130), "{stderr}");
        assert!(stderr.contains(&format!("the state after {stage} epoch ")) && stderr.contains("--resume"), "{stderr}");
        let mut now = contents(run.path());
        assert!(
            now.remove(std::path::Path::new(CHECKPOINT)).is_some() && now.remove(std::path::Path::new("train.log")).is_some()
        );
        assert!(now == before, "other files than the checkpoint and the log were touched");
    }
    let words = done(training(&run, &LONG, &["--resume", "--log", &log]));
    assert!(words.contains("continues after hil epoch "), "{words}");
    assert!(results(&run) == results(&whole));
    assert!(!run.at(CHECKPOINT).exists(), "the checkpoint of a finished run is removed");
    let log = fs::read_to_string(&log).expect("the log");
    let marks = ["warm-start: ", "continues after warm-start epoch ", "hil: ", "continues after hil epoch ", "train: wrote"];
    let places: Vec<usize> =
        marks.iter().map(|mark| log.find(mark).unwrap_or_else(|| panic!("{mark} is not in {log}"))).collect();
    assert!(places.is_sorted(), "{log}");
}

#[test]
fn a_killed_training_goes_on_from_the_last_checkpoint() {
    let (whole, run) = (Run::finished(), Run::finished());
    // several seconds on a fast machine, so that a checkpoint a second is written before the end
    let longer = ["train.warm_start_updates=40000", "train.select_episodes=2", "train.select_candidates=3"];
    let select = [&LONG[..], &longer].concat();
    done(training(&whole, &select, &[]));
    let words = training(&run, &select, &["--checkpoint-every", "1"]);
    let output = stopped(words, "KILL", || run.at(CHECKPOINT).exists());
    assert_eq!(output.status.code(), None);
    let words = done(training(&run, &select, &["--resume"]));
    assert!(words.contains("continues after "), "{words}");
    assert!(results(&run) == results(&whole));
    assert!(!run.at(CHECKPOINT).exists());
}

#[test]
fn without_a_checkpoint_training_starts_from_the_beginning() {
    let run = Run::finished();
    let before = contents(run.path());
    let words = done(training(&run, &[], &["--resume"]));
    assert!(words.contains("policy.checkpoint.safetensors to continue from; starts from the beginning"), "{words}");
    run.unchanged("training anew", &before);
}

/// A run whose training has failed and left a checkpoint; the words of the failure.
fn failed() -> (Run, String) {
    let run = Run::finished();
    let output = hilt(training(&run, &DIVERGING, &[]));
    assert_eq!(output.status.code(), Some(1));
    (run, text(&output.stderr))
}

#[test]
fn a_loss_that_is_no_number_stops_training_and_keeps_the_last_good_state() {
    let before = contents(Run::finished().path());
    let (run, stderr) = failed();
    for part in
        ["error: L_BC (Eq. 3)", "update", "train.learning_rate", "the last good state, after warm-start epoch ", CHECKPOINT]
    {
        assert!(stderr.contains(part), "{part}: {stderr}");
    }
    let (tensors, meta, _) = weights::read(&run.at(CHECKPOINT), weights::CHECKPOINT).expect("a whole checkpoint");
    assert!(!tensors.is_empty() && meta["after"].as_str().is_some_and(|after| after.starts_with("warm-start")), "{meta}");
    let shown = text(&hilt(vec!["inspect".into(), run.name(CHECKPOINT)]).stdout);
    assert!(shown.contains("after: warm-start epoch "), "{shown}");
    fs::remove_file(run.at(CHECKPOINT)).expect("removed");
    run.unchanged("a failed training", &before);
}

#[test]
fn a_checkpoint_of_another_run_is_refused() {
    let (run, _) = failed();
    let resumed =
        |sets: &[&str], further: &[&str]| training(&run, &[&DIVERGING, sets].concat(), &[&["--resume"], further].concat());
    let says = ["checkpoint of another run", "without --resume"];
    let seeded = resumed(&[], &[]).into_iter().map(|w| if w == "0" { "5".into() } else { w }).collect();
    run.refuses(seeded, &[&says[..], &["seed was 0, now it is 5"]].concat());
    run.refuses(resumed(&["train.rho=0.25"], &[]), &[&says[..], &["train.rho was 0.3, now it is 0.25"]].concat());
    run.refuses(resumed(&[], &["--method", "sc"]), &[&says[..], &["method was \"hil\", now it is \"sc\""]].concat());
    let converted: Vec<String> = run.words("convert").into_iter().chain(["--set", "convert.demos=3"].map(String::from)).collect();
    assert!(matches!(hilt(converted).status.code(), Some(0 | 3)));
    run.refuses(resumed(&[], &[]), &[&says[..], &["inputs.dataset was"]].concat());
}

#[test]
fn a_damaged_checkpoint_is_refused_and_training_can_start_anew() {
    let (run, _) = failed();
    let whole = fs::read(run.at(CHECKPOINT)).expect("the checkpoint");
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 1;
    let policy = fs::read(run.at("policy.safetensors")).expect("weights");
    for bytes in [&whole[..whole.len() / 2], &flipped, b"one, two", &policy, b""] {
        fs::write(run.at(CHECKPOINT), bytes).expect("damaged");
        run.refuses(training(&run, &DIVERGING, &["--resume"]), &[CHECKPOINT, "without --resume"]);
    }
    let words = done(training(&run, &[], &[]));
    assert!(words.contains("will be replaced") && !run.at(CHECKPOINT).exists(), "{words}");
}

#[test]
fn a_dataset_of_one_episode_is_refused_in_words() {
    let run = Run::finished();
    let one = run.words("convert").into_iter().chain(["--set", "convert.demos=1"].map(String::from)).collect();
    assert!(matches!(hilt(one).status.code(), Some(0 | 3)));
    for stage in ["pretrain", "train"] {
        run.refuses(run.words(stage), &["dataset", "training demos: 1", "validation demos: none", "10:1", "plan.episodes"]);
    }
}

#[test]
fn rho_and_alpha_out_of_range_are_named_as_they_were_typed() {
    let run = Run::finished();
    let allowed = "must be between 0 and 1";
    for (words, says) in [
        (["--rho", "-0.5"], "--rho -0.5: train.rho = -0.5"),
        (["--rho", "1.5"], "--rho 1.5: train.rho = 1.5"),
        (["--alpha", "2"], "--alpha 2: train.alpha = 2"),
        (["--set", "train.rho=1.5"], "--set train.rho=1.5: train.rho = 1.5"),
        (["--set", "train.alpha=-1"], "--set train.alpha=-1: train.alpha = -1"),
    ] {
        run.refuses(training(&run, &[], &words), &[says, allowed]);
    }
    run.refuses(training(&run, &[], &["--alpha", "lots"]), &["--alpha lots: ", "\"adaptive\" or a number between 0 and 1"]);
}

#[test]
fn the_selection_is_stated_in_the_weights() {
    let run = Run::finished();
    let sets = ["train.select_episodes=2", "train.select_candidates=1000", "train.epochs=2"];
    for method in ["hil", "bc"] {
        done(training(&run, &sets, &["--method", method]));
        let meta = weights::read(&run.at("policy.safetensors"), "policy").expect("weights").1;
        let stated = &meta["selection"];
        assert_eq!((&stated["episodes"], &stated["seed"]), (&2.into(), &0.into()), "{stated}");
        let candidates = stated["candidates"].as_array().expect("a list");
        let found: Vec<u64> = candidates.iter().rev().take(2).rev().map(|c| c["epoch"].as_u64().expect("an epoch")).collect();
        assert_eq!(found, [1, 2], "{stated}");
        assert_eq!(candidates[0]["stage"], "warm-start");
        assert!(candidates.contains(&stated["chosen"]), "{stated}");
        let shown = text(&hilt(vec!["inspect".into(), run.name("policy.safetensors")]).stdout);
        assert!(shown.contains("selection") && shown.contains("chosen"), "{shown}");
    }
}
