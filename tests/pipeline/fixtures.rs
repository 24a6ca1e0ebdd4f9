//! The files in `fixtures/` against today's code: formats do not change silently.

use crate::runs::{HILT, contents, text};
use hilt::data::dataset::{self, Dataset, DatasetEpisode};
use hilt::data::{recording, table_file, weights};
use hilt::learn::Policy;
use hilt::robot::file::built_in::paper_robot;
use hilt::table::Values;
use hilt::task::built_in::find;
use hilt::tensor::NamedTensor;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Difference of angles and velocities that another processor may make in a plan \[rad, rad/s\].
const ROUNDING: f64 = 1e-3;
/// Control steps by which contacts may shift for the same reason.
const SHIFT_STEPS: usize = 5;

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures")
}

/// The files of two directories have the same names; returns those whose bytes differ.
fn differing(here: &Path, there: &Path) -> Vec<PathBuf> {
    let (here, there) = (contents(here), contents(there));
    assert_eq!(here.keys().collect::<Vec<_>>(), there.keys().collect::<Vec<_>>());
    here.into_iter().filter(|(name, bytes)| there[name] != *bytes).map(|(name, _)| name).collect()
}

#[test]
fn every_format_is_written_as_it_was() {
    let (old, new) = (fixtures().join("pick-up"), tempfile::tempdir().expect("temporary directory"));
    let at = |name: &str| (old.join(name), new.path().join(name));

    let (from, to) = at("plans.parquet");
    let (table, origin) = table_file::read(&from).expect("plans");
    table_file::write(&to, &table, &origin).expect("written");

    let (from, to) = at("recordings/episode-00000.mcap");
    let (episode, origin) = recording::read(&from).expect("a recording");
    recording::write(&to, &episode, &origin).expect("written");

    let (from, to) = at("dataset/validation");
    let Dataset { task, demos, rewards, successes, source_episodes, provenance, .. } = dataset::read(&from).expect("a dataset");
    let rows: Vec<DatasetEpisode> = (0..demos.len())
        .map(|i| DatasetEpisode {
            source_index: source_episodes[i],
            demo: demos[i].clone(),
            rewards: rewards[i].clone(),
            success: successes[i],
        })
        .collect();
    dataset::write(&to, (&paper_robot(), &find(&task).expect("a task")), &rows.as_slice().into(), &provenance).expect("written");

    let (from, to) = at("policy.safetensors");
    let (tensors, meta, origin) = weights::read(&from, "policy").expect("weights");
    weights::write(&to, "policy", &tensors, &meta, &origin).expect("written");

    assert_eq!(differing(&old, new.path()), [] as [PathBuf; 0], "fixtures/README.md says what to do");
}

/// From before recordings and datasets said whose they are.
#[test]
fn files_of_the_version_before_are_of_the_papers_robot() {
    let older = fixtures().join("older");
    let (episode, _) = recording::read(&older.join("episode-00000.mcap")).expect("a recording");
    let found = dataset::read(&older.join("dataset")).expect("a dataset");
    assert_eq!(episode.scene.robot, paper_robot());
    let task = find(&found.task).expect("a task");
    assert_eq!(found.layout, task.layout(&paper_robot()));
    let demo = episode.to_demo().expect("a demo");
    assert_eq!((found.demos[0].states(), found.demos[0].layout()), (demo.states(), demo.layout()));
}

/// From before weights named the inputs of their network.
#[test]
fn a_policy_that_does_not_name_its_inputs_is_the_same_policy() {
    let read = |path: PathBuf| {
        let (tensors, meta, _) = weights::read(&path, "policy").expect("weights");
        (Policy::from_tensors(&tensors, &meta).expect("a policy"), meta)
    };
    let (old, old_meta) = read(fixtures().join("older/policy.safetensors"));
    let (new, new_meta) = read(fixtures().join("pick-up/policy.safetensors"));
    assert!(old_meta.get("inputs").is_none() && new_meta["inputs"].is_array());
    assert_eq!(old.meta()["inputs"], new_meta["inputs"]);
    let shapes = |policy: &Policy| policy.to_tensors().into_iter().map(|t| (t.name, t.shape)).collect::<Vec<_>>();
    assert_eq!(shapes(&old), shapes(&new));
}

#[test]
fn the_command_in_their_readme_makes_them() {
    let readme = fs::read_to_string(fixtures().join("README.md")).expect("readable");
    let command = readme.split("```sh\n").nth(1).and_then(|rest| rest.split("```").next()).expect("a command");
    let new = tempfile::tempdir().expect("temporary directory");
    fs::copy(fixtures().join("pick-up.toml"), new.path().join("pick-up.toml")).expect("copied");
    let bin = Path::new(HILT).parent().expect("a directory").to_str().expect("UTF-8 path");
    let path = format!("{bin}:{}", std::env::var("PATH").expect("set"));
    let output = Command::new("bash").args(["-euc", command]).env("PATH", path).current_dir(new.path()).output().expect("bash");
    assert!(output.status.success(), "{}", text(&output.stderr));

    let (old, new) = (fixtures().join("pick-up"), new.path().join("pick-up"));
    for name in differing(&old, &new) {
        println!("{}: other bytes than those kept; comparing what they say", name.display());
        match name.to_str().expect("UTF-8 path") {
            "plans.parquet" => same_plans(&old.join(&name), &new.join(&name)),
            "policy.safetensors" => same_weights(&old.join(&name), &new.join(&name)),
            "recordings/episode-00000.mcap" => same_episode(&old.join(&name), &new.join(&name)),
            // A copy of the recording in a format that the test above holds.
            other => assert!(other.starts_with("dataset/"), "{other} has no comparison"),
        }
    }
}

fn same_plans(old: &Path, new: &Path) {
    let (old, new) = (table_file::read(old).expect("plans").0, table_file::read(new).expect("plans").0);
    assert_eq!(old.columns.len(), new.columns.len());
    for (a, b) in old.columns.iter().zip(&new.columns) {
        assert_eq!((&a.name, &a.doc), (&b.name, &b.doc));
        match (&a.values, &b.values) {
            (Values::F64(a), Values::F64(b)) => {
                assert!(a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < ROUNDING))
            }
            (a, b) => assert_eq!(a, b),
        }
    }
}

/// Numbers are left out: how training goes is no matter of formats.
fn same_weights(old: &Path, new: &Path) {
    let read = |path: &Path| weights::read(path, "policy").expect("weights");
    let ((old, old_meta, _), (new, new_meta, _)) = (read(old), read(new));
    let shapes = |tensors: &[NamedTensor]| tensors.iter().map(|t| (t.name.clone(), t.shape.clone())).collect::<Vec<_>>();
    assert_eq!(shapes(&old), shapes(&new));
    let keys = |meta: &serde_json::Value| meta.as_object().expect("an object").keys().cloned().collect::<Vec<_>>();
    assert_eq!(keys(&old_meta), keys(&new_meta));
}

fn same_episode(old: &Path, new: &Path) {
    let (old, new) = (recording::read(old).expect("a recording").0, recording::read(new).expect("a recording").0);
    assert_eq!((old.scene, old.success), (new.scene, new.success));
    assert!(old.steps.len().abs_diff(new.steps.len()) <= SHIFT_STEPS);
}
