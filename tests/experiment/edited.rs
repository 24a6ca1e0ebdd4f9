//! An experiment that is changed after some of its runs.

use crate::sweep::{DIR, Sweep, TINY, same};

#[test]
fn a_changed_experiment_is_refused_by_name_and_a_grown_one_goes_on() {
    let sweep = Sweep::new(TINY);
    sweep.done(&["--seeds", "11"]);
    let before = sweep.results();

    let policy = format!("{DIR}/pick-up/seed-11/best/rho-0.6/hil/policy.safetensors");
    sweep.edit(&TINY.replace("train.rho=0.6", "train.rho=0.7"));
    sweep.refuses(&["--seeds", "11"], &[&policy, "train.rho was 0.6, now it is 0.7", "another", "--dir"]);
    sweep.edit(&TINY.replace("plan.episodes=4", "plan.episodes=5"));
    sweep.refuses(&["--seeds", "11"], &["plans.parquet: plan.episodes was 4, now it is 5"]);
    sweep.edit(&TINY.replace("\"rho-0.6\"", "\"mixed\""));
    sweep.refuses(&["--seeds", "11"], &[&format!("{DIR}/pick-up/seed-11/best/rho-0.6/hil/"), "belongs to no run"]);
    sweep.edit(TINY);
    sweep.refuses(&["--seeds", "12"], &[&format!("{DIR}/pick-up/seed-11/"), "belongs to no run"]);
    same(&sweep.results(), &before);

    // Grown, it keeps what is there.
    let words = sweep.done(&[]);
    assert!(words.contains("10 of 20 steps to do"), "{words}");
    let after = sweep.results();
    assert!(
        before.iter().filter(|(name, _)| *name != std::path::Path::new("results.csv")).all(|(name, bytes)| after[name] == *bytes)
    );
}

#[test]
fn a_training_that_was_stopped_does_not_go_on_as_another() {
    let long = TINY
        .replace("warm_start_updates=10", "bc_batch=64\", \"train.warm_start_updates=20000")
        .replace("methods = [\"hil\", \"bc\"]", "methods = [\"hil\"]");
    let sweep = Sweep::new(&long);
    let child = sweep.start(&["--seeds", "11"]);
    let log = sweep.at(&format!("{DIR}/logs/pick-up/seed-11/best/plain/hil/train.log"));
    let began = std::time::Instant::now();
    let at_work = || std::fs::read_to_string(&log).is_ok_and(|words| words.contains("warm-start: "));
    while !at_work() && began.elapsed().as_secs() < 60 {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    assert!(at_work(), "the training has not begun");
    crate::ends::signal(&child, "TERM");
    let output = child.wait_with_output().expect("ended");
    assert_eq!(output.status.code(), Some(143));
    let checkpoint = format!("{DIR}/pick-up/seed-11/best/plain/hil/policy.checkpoint.safetensors");
    assert!(sweep.at(&checkpoint).is_file());
    sweep.edit(&long.replace("train.hidden_units=16", "train.hidden_units=17"));
    sweep.refuses(&["--seeds", "11"], &[&checkpoint, "train.hidden_units was 16, now it is 17"]);
}
