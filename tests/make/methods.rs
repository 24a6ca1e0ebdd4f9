//! Methods beside each other, artefacts as targets, and what `make clean-runs` removes.

use crate::{ALL, Run, TINY, command, stages, text, tree};
use std::fs;

#[test]
fn another_method_gets_a_policy_of_its_own() {
    let run = Run::finished();
    let before = run.contents();
    for method in ["bc", "sc", "ppo", "bc-rl"] {
        let word = format!("METHOD={method}");
        assert_eq!(run.all(&[&word]), ALL[4..], "{method}");
        let output = run.make(&[&word]);
        let said = text(&output.stdout);
        assert!(said.starts_with(&format!("pick-up by {method}: ")) && said.contains(&format!("policy-{method}.safetensors")));
        assert!(stages(&output).is_empty());
    }
    let after = run.contents();
    assert!(before.iter().all(|(name, bytes)| after[name] == *bytes), "a file of hil was changed");
    for name in ["policy-bc.safetensors", "evaluation-bc.json", "settings/train-sc.toml", "settings/evaluate-sc.toml"] {
        assert!(run.at(name).exists(), "{name}");
    }
    assert!(run.all(&[]).is_empty());
}

#[test]
fn an_artefact_is_a_target() {
    let (tree, set) = (tree(), format!("SET={TINY}"));
    for (target, ran) in [("dataset", &ALL[..3]), ("recordings", &[]), ("policy.safetensors", &ALL[3..5])] {
        let output = command(tree.path(), &[&format!("runs/pick-up/{target}"), &set]).output().expect("make runs");
        assert!(output.status.success(), "{target}: {}", text(&output.stderr));
        assert_eq!(stages(&output), ran, "{target}");
    }
}

#[test]
fn clean_runs_removes_what_make_made_and_nothing_else() {
    let run = Run::finished();
    run.all(&["METHOD=bc"]);
    let runs = run.tree.path().join("runs");
    let clean = || command(run.tree.path(), &["clean-runs"]).output().expect("make runs");
    fs::write(run.at(".DS_Store"), "").expect("written");
    for name in ["plans.unfinished/run-0/a", "recordings.unfinished/run-1/b", "recordings.unfinished/.DS_Store"] {
        fs::create_dir_all(run.at(name).parent().expect("below the run")).expect("made");
        fs::write(run.at(name), "").expect("written");
    }
    fs::create_dir_all(runs.join("stack")).expect("made");
    fs::write(runs.join("stack/plans.parquet"), "another task's").expect("written");
    let foreign =
        ["thesis.tex", "recordings/notes.md", "dataset/train/README.md", "dataset/train/videos/a.mp4", "policy.best.safetensors"];
    for name in foreign {
        fs::create_dir_all(run.at(name).parent().expect("below the run")).expect("made");
        fs::write(run.at(name), "years of work").expect("written");
    }
    let output = clean();
    let stderr = text(&output.stderr);
    assert!(output.status.success() && stderr.contains("runs/pick-up stays") && stderr.contains("thesis.tex"), "{stderr}");
    let mut left: Vec<_> = run.contents().into_keys().map(|name| name.to_str().expect("UTF-8").to_string()).collect();
    left.sort();
    let mut expected = foreign;
    expected.sort_unstable();
    assert_eq!(left, expected);

    let run = Run::finished();
    assert!(command(run.tree.path(), &["clean-runs"]).output().expect("make runs").status.success());
    assert!(!run.at("").exists() && run.tree.path().join("runs").exists());
    assert!(runs.join("stack/plans.parquet").exists());
    // Nothing there is no fault.
    assert!(command(run.tree.path(), &["clean-runs"]).output().expect("make runs").status.success());
}
