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
