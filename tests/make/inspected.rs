//! What `hilt inspect RUN` calls stale is what make would run again.

use crate::{ALL, Run, TINY, text};
use std::fs::{self, File};
use std::path::Path;
use std::process::Command;
use std::time::{Duration, SystemTime};

/// Stages by `hilt inspect RUN --json` that are not whole.
fn by_inspect(run: &Run) -> Vec<String> {
    let output = Command::new(env!("CARGO_BIN_EXE_hilt")).args(["inspect", "--json"]).arg(run.at("")).output().expect("runs");
    assert!(output.status.success(), "{}", text(&output.stderr));
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let stages = found["stages"].as_array().expect("stages").clone();
    let not_whole = stages.iter().filter(|stage| stage["condition"] != "whole");
    not_whole.map(|stage| stage["name"].as_str().expect("a name").to_string()).collect()
}

/// Stages that `make all` would run, by what it prints without doing it.
fn by_make(run: &Run) -> Vec<String> {
    let set = format!("SET={TINY}");
    let mut command = crate::command(run.tree.path(), &["stages", "LAST=evaluate", "--dry-run", &set]);
    let output = command.output().expect("make runs");
    let said = text(&output.stdout);
    let stage = |line: &str| line.strip_prefix("target/release/hilt ").and_then(|rest| rest.split(' ').next().map(String::from));
    said.lines().filter_map(stage).collect()
}

#[test]
fn inspect_and_make_agree_on_what_is_stale() {
    let later = |path: &Path| {
        let file = File::options().append(true).open(path).expect("opened");
        file.set_modified(SystemTime::now() + Duration::from_secs(2)).expect("touched");
    };
    let run = Run::finished();
    assert_eq!((by_inspect(&run), by_make(&run)), (vec![], vec![]));
    // Changed by hand, though to the same bytes.
    later(&run.at("dynamics.safetensors"));
    assert_eq!(by_inspect(&run), ALL[4..]);
    assert_eq!(by_make(&run), ALL[4..]);

    // Stopped while its artefact was put in place.
    let run = Run::finished();
    let begun = run.at("settings/.simulate.begun");
    fs::copy(run.at("settings/simulate.toml"), &begun).expect("copied");
    let old = SystemTime::UNIX_EPOCH + Duration::from_secs(1);
    File::options().append(true).open(&begun).expect("opened").set_modified(old).expect("touched");
    assert_eq!(by_inspect(&run), ALL[1..]);
    assert_eq!(by_make(&run), ALL[1..]);

    // Gone: what was made from it is as it was, but make would make it again, and what follows.
    let run = Run::finished();
    fs::remove_file(run.at("policy.safetensors")).expect("removed");
    assert_eq!(by_inspect(&run), ["train"]);
    assert_eq!(by_make(&run), ALL[4..]);
}
