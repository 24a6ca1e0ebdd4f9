//! What is printed or written instead of running, and datasets that were there before.

use crate::files::text;
use crate::sweep::{DIR, STEPS, Sweep, TINY, same};
use serde_json::Value;
use std::fs;
use std::process::Command;

#[test]
fn a_dry_run_tells_steps_and_time_and_makes_nothing() {
    let sweep = Sweep::new(TINY);
    let output = sweep.run(&["--dry-run"]);
    let words = text(&output.stdout);
    assert!(output.status.success() && !sweep.at("runs").exists());
    for part in
        ["pick-up/seed-11/best/plan ", "ready", "waiting", "stated rates", &format!("{STEPS} of {STEPS} steps to do, about")]
    {
        assert!(words.contains(part), "{part}: {words}");
    }
    sweep.done(&["--seeds", "11"]);
    let words = text(&sweep.run(&["--dry-run"]).stdout);
    assert!(words.contains("done") && words.contains("finished steps") && !words.contains("stated rates"), "{words}");
}

#[test]
fn the_listed_commands_run_by_themselves_and_collect_to_the_same_results() {
    let (sweep, whole) = (Sweep::new(TINY), Sweep::new(TINY));
    let output = sweep.run(&["--list", "json"]);
    let steps: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let steps = steps.as_array().expect("a list");
    assert_eq!(steps.len(), STEPS);
    assert!(!sweep.at("runs").exists());
    for step in steps {
        let words: Vec<&str> = step["command"].as_array().expect("words").iter().filter_map(Value::as_str).collect();
        let inputs = step["inputs"].as_array().expect("inputs").len();
        assert_eq!(step["state"], if inputs == 0 { "ready" } else { "waiting" });
        let output =
            Command::new(crate::sweep::HILT).args(&words[1..]).current_dir(sweep.at("")).output().expect("the binary runs");
        assert!(output.status.success(), "{words:?}: {}", text(&output.stderr));
        for made in step["outputs"].as_array().expect("outputs") {
            assert!(sweep.at(made.as_str().expect("a path")).exists(), "{made}");
        }
    }
    let output = sweep.run(&["--collect"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    whole.done(&[]);
    same(&sweep.results(), &whole.results());
    let states = text(&sweep.run(&["--list", "json"]).stdout);
    assert_eq!(states.matches("\"done\"").count(), STEPS);
}

#[test]
fn results_of_a_part_are_an_error_that_counts_what_is_missing() {
    let sweep = Sweep::new(TINY);
    // Somebody's own table in the place of the results is known before the work.
    std::fs::create_dir_all(sweep.at("mine")).expect("made");
    std::fs::write(sweep.at("mine/results.csv"), "a,b\n").expect("written");
    sweep.refuses(&["--dir", "mine"], &["results.csv", "was not made by hilt experiment"]);
    sweep.done(&["--seeds", "11"]);
    let output = sweep.run(&["--collect"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("3 of 6 runs are not finished"), "{}", text(&output.stderr));
}

#[test]
fn a_given_dataset_takes_the_place_of_own_demos() {
    let sweep = Sweep::new(TINY);
    sweep.done(&["--seeds", "11"]);
    let given = format!("episodes = 2\ndataset = \"{DIR}/{{task}}/seed-{{seed}}/best/dataset\"");
    sweep.edit(&TINY.replace("episodes = 2", &given));
    let words = sweep.done(&["--seeds", "11", "--dir", "second"]);
    assert!(words.contains("7 of 7 steps to do"), "{words}");
    for name in ["best/dynamics.safetensors", "best/plain/hil/policy.safetensors", "best/plain/bc/evaluation.json"] {
        let [one, other] = [DIR, "second"].map(|dir| fs::read(sweep.at(&format!("{dir}/pick-up/seed-11/{name}"))).expect("made"));
        assert!(one == other, "{name}");
    }
    let words = sweep.done(&["--seeds", "11", "--dir", "second"]);
    assert!(words.contains("0 of 7 steps to do"), "{words}");
}

#[test]
fn workflows_are_written_and_written_again() {
    let sweep = Sweep::new(TINY);
    for (program, name, parts) in [
        ("snakemake", "Snakefile", ["rule collect:", "directory(\"runs/experiments/tiny/pick-up/seed-11/best/recordings\")"]),
        ("slurm", "submit.sh", ["submit evaluate 6", "step runs/experiments/tiny/pick-up/seed-11/best/recordings -- simulate"]),
    ] {
        let path = sweep.at(&format!("{DIR}/{name}"));
        sweep.done(&["--emit", program]);
        let first = fs::read_to_string(&path).expect("written");
        assert!(parts.iter().all(|part| first.contains(part)), "{first}");
        sweep.done(&["--emit", program]);
        assert_eq!(fs::read_to_string(&path).expect("written"), first);
        sweep.done(&["--emit", program, "--out", "mine"]);
        fs::remove_file(sweep.at("mine")).expect("written");
    }
    let checked = Command::new("bash").arg("-n").arg(sweep.at(&format!("{DIR}/submit.sh"))).status().expect("bash runs");
    assert!(checked.success());
}
