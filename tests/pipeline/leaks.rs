//! What must not be learned from itself, and evaluations that say on what they were.

use crate::runs::{Run, hilt, text};
use hilt::data::dataset;
use std::fs;
use std::path::Path;

fn copy_dir(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("made");
    for entry in fs::read_dir(from).expect("readable").flatten() {
        let to = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy_dir(&entry.path(), &to);
        } else {
            fs::copy(entry.path(), to).expect("copied");
        }
    }
}

#[test]
fn a_recording_that_is_there_twice_is_refused() {
    let run = Run::finished();
    fs::copy(run.at("recordings/episode-00001.mcap"), run.at("recordings/episode-00009.mcap")).expect("copied");
    run.refuses(run.words("convert"), &["episode-00009.mcap", "same episode as episode-00001.mcap"]);
}

#[test]
fn episodes_of_merged_runs_keep_numbers_of_their_own_and_it_is_said() {
    let (run, other) = (Run::finished(), Run::new("pick-up", 5));
    for stage in ["plan", "simulate"] {
        assert_eq!(hilt(other.words(stage)).status.code(), Some(0));
    }
    for number in 0..4 {
        let name = |number: u64| format!("recordings/episode-{number:05}.mcap");
        fs::copy(other.at(name(number)), run.at(name(number + 90))).expect("copied");
    }
    let output = hilt(run.words("convert"));
    assert!(text(&output.stderr).contains("several runs, seeds 0, 5"), "{}", text(&output.stderr));
    let read = |name: &str| dataset::read(&run.at("dataset").join(name)).expect("a dataset").source_episodes;
    let mut numbers = [read("train"), read("validation")].concat();
    numbers.sort_unstable();
    assert_eq!(numbers, [0, 1, 2, 3, 90, 91, 92, 93]);
}

#[test]
fn validation_episodes_that_are_trained_on_are_refused() {
    let run = Run::finished();
    fs::remove_dir_all(run.at("dataset/validation")).expect("removed");
    copy_dir(&run.at("dataset/train"), &run.at("dataset/validation"));
    for stage in ["pretrain", "train"] {
        run.refuses(run.words(stage), &["training episode 0 is validation episode 0"]);
    }
}

#[test]
fn an_evaluation_on_another_scene_than_the_trained_one_says_so() {
    let run = Run::finished();
    let evaluate = |sets: &[&str]| {
        let sets = sets.iter().flat_map(|set| ["--set".to_string(), set.to_string()]);
        let output = hilt(run.words("evaluate").into_iter().chain(sets).chain(["--json".into()]).collect());
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        (text(&output.stdout), text(&output.stderr))
    };
    let (summary, words) = evaluate(&[]);
    assert!(!summary.contains("differs_from_training") && !words.contains("another scene"), "{words}");
    let (summary, words) = evaluate(&["scene.yaw=true", "simulate.noise_variance=0.01"]);
    assert!(words.contains("scene.yaw is true, the policy was trained with false"), "{words}");
    let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
    let expected = serde_json::json!({ "scene.yaw": [false, true], "simulate.noise_variance": [0.001, 0.01] });
    assert_eq!(summary["differs_from_training"], expected);
}

/// Keys that came later stand for how every world was before.
#[test]
fn a_policy_from_before_a_key_of_the_scene_was_trained_in_the_scene_as_it_is() {
    let fixture = |name: &str| format!("{}/fixtures/{name}", env!("CARGO_MANIFEST_DIR"));
    let evaluate = |set: &str| {
        let (pipeline, policy) = (fixture("pick-up.toml"), fixture("older/policy.safetensors"));
        let words = ["evaluate", "--pipeline", &pipeline, "--policy", &policy, "--episodes", "1", "--set", set];
        text(&hilt(words.map(String::from).to_vec()).stderr)
    };
    let said = |key: &str, value: &str| format!("{key} is {value}, the policy was trained with \"missing\": another scene");
    for (set, said) in [
        ("simulate.delay_steps=0", String::new()),
        ("simulate.delay_steps=2", said("simulate.delay_steps", "2.0")),
        ("scene.finger_friction=[0.1,1.0]", said("scene.finger_friction", "[0.1,1.0]")),
    ] {
        let words = evaluate(set);
        let count = words.matches("another scene").count();
        assert!(words.contains(&said) && count == usize::from(!said.is_empty()), "{set}: {words}");
    }
}
