//! Reinforcement learning as a command, alone and after behavior cloning: the same bytes, and interrupted it goes on.

use crate::interrupted::{signal, start};
use crate::runs::{Run, contents, hilt, text};
use std::fs;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Iterations of 128 steps.
const ITERATIONS: u64 = 40;
/// How long a run may take until it has kept something.
const PATIENCE: Duration = Duration::from_secs(60);
/// The methods that learn in the simulator.
const METHODS: [&str; 2] = ["ppo", "bc-rl"];

/// Training over the files of a finished run, whose policy it replaces.
fn words(run: &Run, method: &str, further: &[&str]) -> Vec<String> {
    let steps = format!("train.ppo.total_steps={}", 128 * ITERATIONS);
    let sets = [
        "train.hidden_units=16",
        "train.warm_start_updates=10",
        "train.epochs=1",
        "train.min_updates=0",
        "train.ppo.worlds=8",
        "train.ppo.steps=16",
        "train.ppo.horizon_steps=20",
        &steps,
    ];
    let mut words = ["train", "--method", method, "--task", "pick-up", "--seed", "3", "--out"].map(String::from).to_vec();
    words.push(run.name("policy.safetensors"));
    if method != "ppo" {
        words.extend(["--dataset".into(), run.name("dataset")]);
    }
    words.extend(sets.iter().flat_map(|set| ["--set".to_string(), set.to_string()]));
    words.extend(further.iter().map(|word| word.to_string()));
    words
}

#[test]
fn it_learns_to_the_same_bytes_and_its_policy_is_one_like_others() {
    for method in METHODS {
        let (one, two) = (Run::finished(), Run::finished());
        let before = contents(one.path());
        for (run, threads) in [(&one, "1"), (&two, "2")] {
            let output = hilt(words(run, method, &["--threads", threads]));
            assert_eq!(output.status.code(), Some(0), "{method}: {}", text(&output.stderr));
        }
        let after = contents(one.path());
        assert!(after == contents(two.path()), "{method}: other bytes with two threads");
        let changed = after.iter().filter(|(name, bytes)| before.get(*name) != Some(bytes)).count();
        assert_eq!(changed, 2, "{method}: weights and the table of epochs");
        let output = hilt(one.words("evaluate"));
        assert_eq!(output.status.code(), Some(0), "{method}: {}", text(&output.stderr));
    }
}

#[test]
fn interrupted_it_goes_on_to_the_bytes_of_an_undisturbed_run() {
    for method in METHODS {
        let (whole, broken) = (Run::finished(), Run::finished());
        assert_eq!(hilt(words(&whole, method, &[])).status.code(), Some(0));
        let (log, began) = (tempfile::NamedTempFile::with_suffix(".log").expect("a file"), Instant::now());
        let child = start(words(&broken, method, &["--log", log.path().to_str().expect("UTF-8")]));
        while !fs::read_to_string(log.path()).expect("readable").contains(&format!("{method}: ")) {
            assert!(began.elapsed() < PATIENCE, "training has not come so far");
            sleep(Duration::from_millis(1));
        }
        signal(&child, "INT");
        let output = child.wait_with_output().expect("ended");
        assert_eq!(output.status.code(), Some(130), "{method}: {}", text(&output.stderr));
        let output = hilt(words(&broken, method, &["--resume", "--threads", "1"]));
        let (said, place) = (text(&output.stderr), format!("continues after {method} epoch "));
        assert!(output.status.success() && said.contains(&place), "{method}: {said}");
        assert!(contents(broken.path()) == contents(whole.path()), "{method}: other bytes than undisturbed");
    }
}

#[test]
fn what_it_cannot_learn_from_is_refused() {
    let run = Run::finished();
    let refuses = |further: &[&str], says: &[&str]| run.refuses(words(&run, "bc-rl", further), says);
    refuses(&["--set", "train.bc_rl.lambda=-1"], &["train.bc_rl.lambda = -1"]);
    refuses(&["--set", "train.bc_rl.lambda_decay=1.5"], &["train.bc_rl.lambda_decay = 1.5"]);
    refuses(&["--set", "train.bc_rl.initial_std=0"], &["train.bc_rl.initial_std = 0"]);
    refuses(&["--set", "train.bc_rl.lamda=1"], &["lamda", "lambda"]);
    let mut elsewhere = words(&run, "bc-rl", &[]);
    let at = elsewhere.iter().position(|word| word == "--dataset").expect("a dataset");
    elsewhere[at + 1] = run.name("nothing");
    run.refuses(elsewhere, &["nothing"]);
}
