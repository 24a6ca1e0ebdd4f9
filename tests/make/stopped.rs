//! Signals to `make`.

use crate::{Run, TINY, command, text};
use std::os::unix::process::CommandExt;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// For a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// By the shell's own `kill`: the program's takes a negative number for a signal now and then.
fn signal(name: &str, whom: &str) -> bool {
    Command::new("bash")
        .args(["-c", "kill -s \"$0\" -- \"$1\"", name, whom])
        .stderr(Stdio::null())
        .status()
        .expect("bash")
        .success()
}

/// Processes of a group that still run.
fn alive(group: &str) -> usize {
    let all = text(&Command::new("ps").args(["-A", "-o", "pgid=,stat="]).output().expect("ps runs").stdout);
    let alive = |line: &str| matches!(line.split_whitespace().collect::<Vec<_>>()[..], [id, state] if id == group && !state.starts_with('Z'));
    all.lines().filter(|line| alive(line)).count()
}

#[test]
fn a_signal_reaches_training_and_make_waits_for_its_checkpoint() {
    // What `kill` sends goes to make alone, which passes it on; Ctrl-C goes to the whole group; what `timeout` sends goes both ways.
    for (name, to_all) in [("TERM", false), ("INT", true), ("TERM", true)] {
        let run = Run::finished();
        let set = format!("SET={TINY} train.warm_start_updates=10000000");
        let mut make = command(run.tree.path(), &["all", &set, "CHECKPOINT=1"]).process_group(0).spawn().expect("make runs");
        let (alone, all) = (make.id().to_string(), format!("-{}", make.id()));
        let started = Instant::now();
        while !run.at("policy.checkpoint.safetensors").exists() && started.elapsed() < PATIENCE {
            std::thread::sleep(Duration::from_millis(10));
        }
        assert!(signal(name, if to_all { &all } else { &alone }), "{name}: make has ended");
        let sent = Instant::now();
        while make.try_wait().expect("waits").is_none() {
            assert!(sent.elapsed() < PATIENCE || !signal("KILL", &all), "{name}: make does not end");
            std::thread::sleep(Duration::from_millis(2));
        }
        assert_eq!(alive(&alone), 0, "{name}: make has ended before training");
        let output = make.wait_with_output().expect("ended");
        let stderr = text(&output.stderr);
        assert!(!output.status.success() && stderr.contains("run the same command with --resume"), "{name}: {stderr}");

        let goes_on = run.make(&["RESUME=1", &format!("{set} train.warm_start_updates=20")]);
        assert!(text(&goes_on.stderr).contains("is the checkpoint of another run"), "{}", text(&goes_on.stderr));
        assert!(run.all(&[]).is_empty(), "the policy in place is the one of these settings");
    }
}

#[test]
fn stopped_planning_and_simulation_go_on_by_themselves() {
    let run = Run::finished();
    let before = run.contents();
    for (stage, artefact, first) in [("plan", "plans.parquet", 0), ("simulate", "recordings", 1)] {
        // What a stopped stage leaves: some of its pieces, and no stamp.
        let mut half = Command::new(env!("CARGO_BIN_EXE_hilt"));
        half.args([stage, "--pipeline", "pipelines/pick-up.toml", "--task", "pick-up", "--sets", TINY, "--shard", "1/1"]);
        assert!(half.current_dir(run.tree.path()).output().expect("the binary runs").status.success());
        std::fs::remove_file(run.at(&format!("settings/{stage}.toml"))).expect("removed");
        assert!(run.at(&format!("{}.unfinished", artefact.trim_end_matches(".parquet"))).is_dir());
        let output = run.make(&[]);
        let words = text(&output.stderr);
        assert!(output.status.success() && words.contains(&format!("{stage}: goes on: 4 of 4 episodes")), "{words}");
        assert_eq!(crate::stages(&output), crate::ALL[first..], "{stage}");
        assert!(run.contents() == before, "{stage}: other files than before");
    }
}
