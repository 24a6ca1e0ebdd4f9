//! What is out of date and what is not.

use crate::{ALL, Run, TINY, command, stages, text};
use std::fs::{self, File};
use std::path::Path;
use std::process::Command;
use std::time::SystemTime;

/// What happens to a file.
type Harm<'a> = &'a dyn Fn(&Path);
/// Nothing runs when nothing was changed.
const NOTHING: [&str; 0] = [];

#[test]
fn a_second_make_all_runs_nothing_and_says_what_stands() {
    let run = Run::finished();
    let before = run.contents();
    let output = run.make(&[]);
    assert!(output.status.success() && stages(&output).is_empty(), "{}", text(&output.stderr));
    let (said, summary) = (text(&output.stdout), fs::read_to_string(run.at("evaluation.json")).expect("readable"));
    let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
    let success = format!("pick-up by hil: success {} of 2 ", summary["successes"]);
    for part in [&success[..], "runs/pick-up/policy.safetensors", "runs/pick-up/evaluation.json"] {
        assert!(said.lines().count() == 1 && said.contains(part), "\"{part}\" is not in {said}");
    }
    assert!(run.contents() == before);
}

#[test]
fn several_at_once_on_a_finished_run_do_nothing_and_succeed() {
    let run = Run::finished();
    let (before, set) = (run.contents(), format!("SET={TINY}"));
    let start = || command(run.tree.path(), &["all", &set]).spawn().expect("make runs");
    let all: Vec<_> = (0..6).map(|_| start()).collect();
    for make in all {
        let output = make.wait_with_output().expect("ended");
        assert!(output.status.success() && stages(&output).is_empty(), "{}", text(&output.stderr));
    }
    assert!(run.contents() == before);
}

#[test]
fn a_changed_key_reruns_its_stage_and_what_follows() {
    let run = Run::finished();
    for (set, first) in [("evaluate.episodes=3", 5), ("train.rho=0.4", 4), ("pretrain.epochs=1", 3), ("convert.demos=3", 2)] {
        let output = run.with(set);
        assert!(output.status.success(), "{set}: {}", text(&output.stderr));
        assert_eq!(stages(&output), ALL[first..], "{set}");
        run.all(&[]);
    }
    assert_eq!(run.all(&[]), NOTHING);
}

#[test]
fn what_is_refused_or_fails_leaves_the_run_up_to_date() {
    let run = Run::finished();
    let before = run.contents();
    for (set, says) in [
        ("plan.speeed=0.5", "did you mean plan.speed?"),
        ("plan.episodes=-1", "plan.episodes"),
        ("train.learning_rate=1e30 train.clip_norm=0.0 train.epochs=20", "train.learning_rate"),
    ] {
        let output = run.with(set);
        let stderr = text(&output.stderr);
        assert!(!output.status.success() && stderr.matches("error: ").count() == 1 && stderr.contains(says), "{set}: {stderr}");
        assert_eq!(run.all(&[]), NOTHING, "after {set}");
    }
    for words in [["SEED=99999999999999999999"], ["PIPELINE=missing.toml"], ["PIPELINE=my pipelines/stack.toml"]] {
        assert!(!run.make(&words).status.success());
        assert_eq!(run.all(&[]), NOTHING, "after {words:?}");
    }
    fs::remove_file(run.at("policy.checkpoint.safetensors")).unwrap_or_default();
    assert!(run.contents() == before);
}

#[test]
fn missing_and_truncated_artefacts_are_made_again() {
    let run = Run::finished();
    let before = run.contents();
    let remove = |path: &Path| fs::remove_file(path).expect("removed");
    // The time of the file stays: nothing but its size tells.
    let halve = |path: &Path| {
        let (file, meta) = (File::options().write(true).open(path).expect("a file"), fs::metadata(path).expect("a file"));
        file.set_len(meta.len() / 2).expect("cut");
        file.set_modified(meta.modified().expect("a time")).expect("set");
    };
    let cases: [(&str, Harm, usize); 10] = [
        ("plans.parquet", &remove, 0),
        ("plans.parquet", &halve, 0),
        ("recordings/episode-00002.mcap", &remove, 1),
        ("recordings/episode-00000.mcap", &halve, 1),
        ("dataset/train/data/chunk-000/file-000.parquet", &halve, 2),
        ("dataset/train/meta/info.json", &remove, 2),
        ("dynamics.safetensors", &halve, 3),
        ("policy.safetensors", &halve, 4),
        ("policy.safetensors", &remove, 4),
        ("evaluation.json", &halve, 5),
    ];
    for (name, harm, first) in cases {
        harm(&run.at(name));
        assert_eq!(run.all(&[]), ALL[first..], "{name}");
        assert!(run.contents() == before, "{name}: other bytes than before");
    }
    // What stands beside an artefact belongs to it.
    let beside = [("dynamics.errors.parquet", 3), ("policy.training.parquet", 4), ("evaluation.episodes.parquet", 5)];
    for (name, first) in beside.into_iter().filter(|(name, _)| run.at(name).exists()) {
        halve(&run.at(name));
        assert_eq!(run.all(&[]), ALL[first..], "{name}");
    }
    fs::remove_dir_all(run.at("dataset")).expect("removed");
    assert_eq!(run.all(&[]), ALL[2..]);
    assert_eq!(run.all(&[]), NOTHING);
}

#[test]
fn hidden_and_foreign_files_count_for_nothing() {
    let run = Run::finished();
    for dir in
        ["", "recordings", "dataset", "dataset/train", "dataset/train/data/chunk-000", "dataset/validation/meta", "settings"]
    {
        for name in [".DS_Store", ".directory", "Thumbs.db", ".nfs000000000001", "README.md"] {
            fs::write(run.at(dir).join(name), "not hilt's").expect("written");
        }
    }
    fs::create_dir(run.at("dataset/train/videos")).expect("made");
    assert_eq!(run.all(&[]), NOTHING);
}

#[test]
fn an_artefact_that_was_made_by_hand_is_kept_and_what_follows_runs_on_it() {
    let run = Run::finished();
    let by_hand = |words: &[&str]| {
        let mut hilt = Command::new(env!("CARGO_BIN_EXE_hilt"));
        let output = hilt.args(words).args(["--task", "pick-up"]).current_dir(run.tree.path()).output().expect("the binary runs");
        assert!(matches!(output.status.code(), Some(0 | 3)), "{}", text(&output.stderr));
    };
    let cases: [(&[&str], &str, usize); 3] = [
        (&["simulate", "--episodes", "3", "--seed", "1"], "recordings", 2),
        (&["convert", "--set", "convert.demos=3"], "dataset", 3),
        (&["train", "--set", "train.warm_start_updates=20", "--set", "train.hidden_units=24"], "policy.safetensors", 5),
    ];
    for (words, name, next) in cases {
        by_hand(words);
        let made = run.contents().into_iter().filter(|(path, _)| path.starts_with(name)).collect::<Vec<_>>();
        let output = run.make(&[]);
        assert!(text(&output.stderr).contains("is whole, but not the one that"), "{}", text(&output.stderr));
        assert_eq!(stages(&output), ALL[next..], "{name}");
        assert_eq!(run.all(&[]), NOTHING, "{name}");
        assert!(run.contents().into_iter().filter(|(path, _)| path.starts_with(name)).eq(made), "{name} was replaced");
    }
}

#[test]
fn a_stage_that_was_killed_after_its_artefact_and_before_its_stamp_runs_again() {
    let run = Run::finished();
    let begun = run.at("settings/.train.begun");
    fs::write(&begun, "other settings").expect("written");
    assert_eq!(run.all(&[]), NOTHING, "it ended before it put anything in place");
    assert!(!begun.exists(), "left over");

    fs::write(&begun, "other settings").expect("written");
    let policy = File::options().write(true).open(run.at("policy.safetensors")).expect("weights");
    policy.set_modified(SystemTime::now()).expect("set");
    assert_eq!(run.all(&[]), ALL[4..]);
    assert!(!begun.exists(), "left over");
}
