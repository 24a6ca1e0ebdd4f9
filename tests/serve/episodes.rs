//! An episode is the same whether a policy is run or served.

use crate::servers::{HILT, Process, policy_file};
use hilt::data::recording;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Command;

/// Runs `hilt evaluate` of a policy, and returns its summary without the provenance.
fn evaluate(dir: &Path, policy: &str, more: &[&str]) -> Value {
    let (out, record) = (dir.join("evaluation.json"), dir.join("recordings"));
    let output = Command::new(HILT)
        .args([
            "evaluate",
            "--task",
            "pick-up",
            "--episodes",
            "6",
            "--seed",
            "7",
            "--set",
            "evaluate.horizon_steps=30",
            "--policy",
        ])
        .arg(policy)
        .args(more)
        .arg("--out")
        .arg(&out)
        .arg("--record")
        .arg(&record)
        .output()
        .expect("the binary runs");
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let mut summary: Value = serde_json::from_slice(&fs::read(&out).expect("written")).expect("JSON");
    summary.as_object_mut().expect("an object").remove("hilt");
    summary
}

fn same(more_serve: &[&str], more_native: &[&str]) {
    let (served, native) = (tempfile::tempdir().expect("a directory"), tempfile::tempdir().expect("a directory"));
    let file = policy_file();
    let file = file.to_str().expect("UTF-8 path");
    let server = Process::new(&[&["serve", file], more_serve].concat());
    let theirs = evaluate(served.path(), &server.address, &[]);
    assert_eq!(theirs, evaluate(native.path(), file, more_native));
    assert_eq!(theirs["episodes"], 6);
    let read = |dir: &Path, number: u64| {
        recording::read(&dir.join("recordings").join(recording::file_name(number))).expect("a recording").0
    };
    for number in 0..6 {
        let (theirs, ours) = (read(served.path(), number), read(native.path(), number));
        assert_eq!(theirs.steps.len(), 30);
        assert!(theirs == ours, "episode {number} is another");
    }
}

#[test]
fn a_served_policy_has_the_episodes_of_one_that_is_run_step_for_step() {
    same(&[], &[]);
}

#[test]
fn a_served_policy_samples_as_one_that_is_run() {
    same(&["--stochastic", "--seed", "7"], &["--stochastic"]);
}
