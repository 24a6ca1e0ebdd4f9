//! Reinforcement learning as a command: no dataset, the same bytes, and interrupted it goes on.

use crate::interrupted::{signal, start};
use crate::runs::{Run, contents, hilt, text};
use std::fs;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Iterations of 128 steps.
const ITERATIONS: u64 = 40;
/// How long a run may take until it has kept something.
const PATIENCE: Duration = Duration::from_secs(60);

fn words(run: &Run, further: &[&str]) -> Vec<String> {
    let steps = format!("train.ppo.total_steps={}", 128 * ITERATIONS);
    let sets = ["train.hidden_units=16", "train.ppo.worlds=8", "train.ppo.steps=16", "train.ppo.horizon_steps=20", &steps];
    let mut words = ["train", "--method", "ppo", "--task", "pick-up", "--seed", "3", "--out"].map(String::from).to_vec();
    words.push(run.name("policy.safetensors"));
    words.extend(sets.iter().flat_map(|set| ["--set".to_string(), set.to_string()]));
    words.extend(further.iter().map(|word| word.to_string()));
    words
}

#[test]
fn it_learns_without_a_dataset_to_the_same_bytes_and_its_policy_is_one_like_others() {
    let (one, two) = (Run::new("pick-up", 3), Run::new("pick-up", 3));
    for (run, threads) in [(&one, "1"), (&two, "2")] {
        let output = hilt(words(run, &["--threads", threads]));
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    }
    assert_eq!(contents(one.path()), contents(two.path()));
    assert_eq!(contents(one.path()).len(), 2, "weights and the table of iterations");
    let output = hilt(one.words("evaluate"));
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
}

#[test]
fn interrupted_it_goes_on_to_the_bytes_of_an_undisturbed_run() {
    let (whole, broken) = (Run::new("pick-up", 3), Run::new("pick-up", 3));
    assert_eq!(hilt(words(&whole, &[])).status.code(), Some(0));
    let (log, began) = (tempfile::NamedTempFile::with_suffix(".log").expect("a file"), Instant::now());
    let child = start(words(&broken, &["--log", log.path().to_str().expect("UTF-8")]));
    while !fs::read_to_string(log.path()).expect("readable").contains("ppo: ") {
        assert!(began.elapsed() < PATIENCE, "training has not come so far");
        sleep(Duration::from_millis(1));
    }
    signal(&child, "INT");
    let output = child.wait_with_output().expect("ended");
    assert_eq!(output.status.code(), Some(130), "{}", text(&output.stderr));
    let output = hilt(words(&broken, &["--resume", "--threads", "1"]));
    let said = text(&output.stderr);
    assert!(output.status.success() && said.contains("continues after ppo epoch "), "{said}");
    assert_eq!(contents(broken.path()), contents(whole.path()));
}
