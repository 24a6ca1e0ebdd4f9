//! How a sweep ends early: interrupted, with a step that fails, beside another.

use crate::files::text;
use crate::sweep::{DIR, Sweep, TINY, same};
use std::fs;
use std::process::{Child, Command};
use std::time::Duration;

pub fn signal(child: &Child, name: &str) {
    let sent = Command::new("kill").args([format!("-{name}"), child.id().to_string()]).status().expect("kill runs");
    assert!(sent.success(), "the process has ended already");
}

#[test]
fn a_signal_reaches_the_steps_and_the_sweep_goes_on() {
    let sweep = Sweep::new(&TINY.replace("plan.episodes=4", "plan.episodes=20000"));
    for (name, code) in [("INT", 130), ("TERM", 143)] {
        let child = sweep.start(&[]);
        std::thread::sleep(Duration::from_millis(700));
        signal(&child, name);
        let output = child.wait_with_output().expect("ended");
        let words = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{words}");
        assert!(words.contains("0 of 20 steps are done in runs/experiments/tiny: run the same command to go on"), "{words}");
        let plans = fs::read_to_string(sweep.at(&format!("{DIR}/logs/pick-up/seed-11/best/plan.log"))).expect("a log");
        assert!(!plans.contains("wall time"), "the step has ended by itself: {plans}");
    }
    // No step has outlived it: the locks are free.
    sweep.edit(TINY);
    fs::remove_dir_all(sweep.at(&format!("{DIR}/pick-up"))).expect("removed");
    sweep.done(&["--seeds", "11"]);
}

#[test]
fn the_others_go_on_when_a_step_fails() {
    let (sweep, whole) = (Sweep::new(TINY), Sweep::new(TINY));
    let foreign = sweep.at(&format!("{DIR}/pick-up/seed-11/best/plain/hil/policy.safetensors"));
    fs::create_dir_all(foreign.parent().expect("a directory")).expect("made");
    fs::write(&foreign, "somebody's own").expect("written");
    // The metrics beside it would be there too.
    fs::write(foreign.with_extension("training.parquet"), "somebody's own").expect("written");
    let output = sweep.run(&[]);
    let words = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{words}");
    let log = format!("{DIR}/logs/pick-up/seed-11/best/plain/hil/train.log");
    for part in
        ["steps that failed: 1, 1 that need them were left out", "pick-up/seed-11/best/plain/hil/train: ", "another format", &log]
    {
        assert!(words.contains(part), "{part}: {words}");
    }
    assert_eq!(fs::read_to_string(&foreign).expect("there"), "somebody's own");
    let results = fs::read_to_string(sweep.at(&format!("{DIR}/results.csv"))).expect("results of the others");
    assert_eq!(results.lines().count(), 1 + 5, "{results}");
    // Out of the way, the same command does what is left.
    fs::remove_file(&foreign).expect("removed");
    fs::remove_file(foreign.with_extension("training.parquet")).expect("removed");
    let words = sweep.done(&[]);
    assert!(words.contains("2 of 20 steps to do"), "{words}");
    whole.done(&["--jobs", "2"]);
    same(&sweep.results(), &whole.results());
}

#[test]
fn two_processes_do_not_run_one_sweep() {
    let sweep = Sweep::new(&TINY.replace("plan.episodes=4", "plan.episodes=20000"));
    let mut first = sweep.start(&[]);
    std::thread::sleep(Duration::from_millis(500));
    let output = sweep.run(&[]);
    let words = text(&output.stderr);
    signal(&first, "TERM");
    first.wait().expect("ended");
    assert!(output.status.code() == Some(1) && words.contains("another process runs the experiment"), "{words}");
}
