//! From a dataset of another program to a policy, or to one sentence that says what to do.

use crate::made::{Made, TINY, contents, done, fixture, hilt, made, refused};
use arrow_array::{ArrayRef, Float64Array, Int64Array};
use hilt::data::dataset::foreign::{Choice, open};
use hilt::data::{table_file, weights};
use hilt::interrupt::Interrupt;
use hilt::layout::{Holds, Layout};
use hilt::learn::Policy;
use hilt::serve::{Host, LineLink, PolicyHost, PolicyOptions};
use hilt::table::Values;
use serde_json::{Value, json};
use std::fs;
use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;
use tempfile::tempdir;

const LENGTHS: [usize; 6] = [12, 9, 15, 2, 11, 10];

#[test]
fn a_dataset_written_by_hand_is_read_as_it_says() {
    let dir = tempdir().expect("dir");
    let root = dir.path().join("Spring Mass");
    made(&LENGTHS).write(&root);
    let source = open(&root, &Choice::default()).expect("a dataset");
    let layout = &source.layout;
    assert_eq!((layout.name.as_str(), layout.period_s), ("spring-mass", 0.1));
    assert_eq!((&layout.state[0].holds, &layout.state[0].entries[..]), (&Holds::Numbers, &["x", "v", "k"].map(String::from)[..]));
    assert_eq!((&layout.action[0].holds, &layout.action[0].entries[..]), (&Holds::Commands, &["action".to_string()][..]));
    let read = source.read(2, 0).expect("demos");
    assert_eq!((read.train.len(), read.validation.len()), (4, 2));
    // T frames give T - 1 transitions: nothing says what follows the last.
    let mut steps: Vec<usize> = read.train.iter().chain(&read.validation).map(|demo| demo.len()).collect();
    steps.sort_unstable();
    assert_eq!(steps, [1, 8, 9, 10, 11, 14]);
    let demo = &read.train[0];
    let (s, a) = (demo.state(0), demo.action(0));
    assert!((demo.state(1)[1] - (s[1] + 0.1 * a[0])).abs() < 1e-6, "what follows a row is the next row");
    // The same seed splits the same way, another does not.
    assert_eq!(source.read(2, 0).expect("demos").train, read.train);
    assert!((1..9).any(|seed| source.read(2, seed).expect("demos").train != read.train));
}

/// The first and the last validation loss of a table of epochs.
fn validated(path: &Path, column: &str) -> (f64, f64) {
    let (table, _) = table_file::read(path).expect("a table");
    let Values::F64(values) = &table.columns.iter().find(|c| c.name == column).expect("a column").values else {
        panic!("numbers")
    };
    let known: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    (known[0], known[known.len() - 1])
}

#[test]
fn fixtures_of_other_programs_train_all_three_methods_to_policies_that_carry_their_layout() {
    for (name, state, period) in [("lerobot", 6, 0.1), ("pandas", 6, 0.4), ("edited", 25, 0.05)] {
        let dir = tempdir().expect("dir");
        let data = fixture(name).display().to_string();
        let more = [&["--dataset", &data][..], &TINY].concat();
        let (_, said) = done(dir.path(), &[&["pretrain"], &more[..]].concat());
        assert!(said.contains("training and"), "{said}");
        assert_eq!(said.contains("skips observation.images.top"), name == "lerobot", "{said}");
        let run = dir.path().join("runs").join(name);
        let (first, last) = validated(&run.join("dynamics.pretraining.parquet"), "validation_l_model");
        assert!(last < first, "{name}: {first} to {last}");
        for (method, policy) in [("hil", "policy"), ("bc", "policy-bc"), ("sc", "policy-sc")] {
            done(dir.path(), &[&["train", "--method", method], &more[..]].concat());
            let path = run.join(format!("{policy}.safetensors"));
            let (_, meta, made) = weights::read(&path, weights::POLICY).expect("weights");
            let layout: Layout = serde_json::from_value(meta["layout"].clone()).expect("a layout");
            assert_eq!((layout.state_dim(), layout.period_s, layout.name.as_str()), (state, period, name));
            assert_eq!((made.task.as_str(), &made.settings["columns"]["action"]), (name, &json!(["action"])));
            done(dir.path(), &["inspect", &path.display().to_string()]);
        }
        let (table, _) = table_file::read(&run.join("dynamics.errors.parquet")).expect("a table");
        assert_eq!(table.rows(), layout_groups(name));
    }
}

/// In the user's own simulator or on his robot: by the columns that it has learned from.
#[test]
fn a_policy_of_another_programs_dataset_is_served_by_its_columns() {
    let dir = tempdir().expect("dir");
    let data = fixture("edited").display().to_string();
    done(dir.path(), &[&["train", "--method", "bc", "--dataset", &data][..], &TINY].concat());
    let path = dir.path().join("runs/edited/policy-bc.safetensors");
    let (tensors, meta, _) = weights::read(&path, weights::POLICY).expect("weights");
    let policy = Policy::from_tensors(&tensors, &meta).expect("a policy");
    let row: Vec<f32> = (0..25).map(|i| 0.01 * i as f32).collect();
    let observation = json!({ "observation.state": row[..18], "observation.environment_state": row[18..] });
    let host = PolicyHost::new(policy.clone(), None, PolicyOptions::default(), Default::default()).expect("needs no robot");
    let (mut out, input) = (Vec::new(), format!("{observation}\n"));
    let mut link = LineLink::new(Cursor::new(input), &mut out, &Interrupt::default()).expect("a thread");
    host.converse(&mut link, 0).expect("no interrupt");
    let lines: Vec<Value> = String::from_utf8_lossy(&out).lines().map(|l| serde_json::from_str(l).expect("JSON")).collect();
    assert_eq!((&lines[0]["robot"], lines[0]["needs_dq"].as_bool()), (&Value::Null, Some(false)));
    let actions: Vec<f32> = serde_json::from_value(lines[1]["actions"][0].clone()).expect("numbers");
    assert_eq!(actions, policy.act(&row));
    let why = PolicyHost::new(policy, None, PolicyOptions { estimate_dq: true, ..Default::default() }, Default::default());
    assert!(why.expect_err("there are none").contains("sees no joint velocities"));
    let path = path.display().to_string();
    let said = refused(dir.path(), &["serve", &path, "--robot", "jaco"], 2);
    assert!(said.contains("no limits of a robot fit it; leave --robot out"), "{said}");
}

/// Columns that make a state: each has errors of its own.
fn layout_groups(name: &str) -> usize {
    if name == "pandas" { 1 } else { 2 }
}

#[test]
fn the_same_command_gives_the_same_bytes_for_any_number_of_threads() {
    let dirs = [tempdir().expect("dir"), tempdir().expect("dir")];
    let data = fixture("lerobot").display().to_string();
    let files = dirs.each_ref().map(|dir| {
        let threads = if dir.path() == dirs[0].path() { "1" } else { "2" };
        let more = [&["--dataset", &data, "--threads", threads][..], &TINY].concat();
        done(dir.path(), &[&["pretrain"], &more[..]].concat());
        done(dir.path(), &[&["train"], &more[..]].concat());
        let names =
            |(path, bytes): (std::path::PathBuf, Vec<u8>)| (path.strip_prefix(dir.path()).expect("below").to_path_buf(), bytes);
        contents(dir.path()).into_iter().map(names).collect::<Vec<_>>()
    });
    assert!(
        files[0] == files[1] && files[0].len() == 5,
        "{:?}",
        files.map(|f| f.into_iter().map(|(name, _)| name).collect::<Vec<_>>())
    );
}

#[test]
fn two_roots_are_training_and_validation_and_columns_can_be_chosen() {
    let dir = tempdir().expect("dir");
    let pair = dir.path().join("pair");
    made(&LENGTHS).write(&pair.join("train"));
    let mut other = made(&[8, 9]);
    other.info["total_frames"] = json!(17);
    *other.column("action") = Arc::new(Float64Array::from_iter_values((0..17).map(f64::from)));
    other.write(&pair.join("validation"));
    let read = open(&pair, &Choice::default()).expect("datasets").read(10, 0).expect("demos");
    assert_eq!((read.train.len(), read.validation.len()), (6, 2));

    let choice = Choice { state: vec!["timestamp".into(), "observation.state".into()], action: None };
    let source = open(&pair.join("train"), &choice).expect("a dataset");
    assert_eq!(source.layout.state.iter().map(|span| span.entries.len()).collect::<Vec<_>>(), [1, 3]);
    let words = ["pretrain", "--dataset", "pair", "--state", "observation.stat"];
    let said = refused(dir.path(), &words, 1);
    assert!(said.contains("has no column observation.stat; did you mean observation.state?"), "{said}");
}

#[test]
fn next_states_give_a_transition_more_and_executed_actions_are_taken() {
    let edited = open(&fixture("edited"), &Choice::default()).expect("a dataset");
    let frames: usize =
        edited.read(1, 0).map(|read| read.train.iter().chain(&read.validation).map(|demo| demo.len()).sum()).expect("demos");
    let info: Value =
        serde_json::from_slice(&fs::read(fixture("edited").join("meta/info.json")).expect("readable")).expect("JSON");
    assert_eq!(info["total_frames"], json!(frames), "every frame is a transition");
    let read = edited.read(1, 0).expect("demos");
    assert_ne!(read.train[0].actions(), read.train[0].executed());
}

#[test]
fn what_is_wrong_is_said_in_one_sentence_by_column_and_row() {
    type Spoil = fn(&mut Made);
    let spoilt: [(Spoil, &str); 14] = [
        (
            |m| m.info["codebase_version"] = json!("v2.1"),
            "has codebase_version \"v2.1\", hilt reads \"v3.0\"; convert it first: python -m lerobot",
        ),
        (
            |m| *m = std::mem::replace(m, made(&[2])).without("action"),
            "has no column action; its columns of numbers are observation.state (choose with --action)",
        ),
        (
            |m| *m = std::mem::replace(m, made(&[2])).without("observation.state"),
            "has no column observation.state; name the columns",
        ),
        (|m| *m = std::mem::replace(m, made(&[2])).without("index"), "has no column index, which says where a row belongs"),
        (|m| m.columns.retain(|(name, _)| name != "action"), "has no column action, which meta/info.json declares"),
        (|m| m.info["features"]["action"]["dtype"] = json!("string"), "has string in column action, and numbers are needed"),
        (
            |m| m.info["features"]["observation.state"]["shape"] = json!([4]),
            "column observation.state, row 0: has 3 values, meta/info.json says 4",
        ),
        (|m| spoil_action(m, 13, f64::NAN), "column action, row 13 (episode 1, frame 1), entry 0: NaN is not a finite number"),
        (|m| spoil_action(m, 20, f64::INFINITY), "column action, row 20"),
        (|m| spoil_action(m, 3, 1e7), "larger than 1e6, more than learning can square"),
        (
            |m| spoil_index(m, 14),
            "row 14 has [index, episode_index, frame_index] = [15, 1, 2], expected [14, 1, 2]: frames are numbered without a gap",
        ),
        (
            |m| m.said_lengths.swap(0, 1),
            "row 9 has [index, episode_index, frame_index] = [9, 0, 9], expected [9, 1, 0]: meta/episodes says that episode 0 has 9 frames",
        ),
        (|m| m.info["total_frames"] = json!(60), "says 6 episodes of 60 frames, meta/episodes has 6 of 59"),
        (|m| m.info["fps"] = json!(0.0), "has 0 frames per second; allowed: 0.1 to 100000"),
    ];
    let dir = tempdir().expect("dir");
    for (at, (spoil, said)) in spoilt.into_iter().enumerate() {
        let mut dataset = made(&LENGTHS);
        spoil(&mut dataset);
        dataset.write(&dir.path().join(format!("d{at}")));
        let found = refused(dir.path(), &["train", "--method", "bc", "--dataset", &format!("d{at}")], 1);
        assert!(found.contains(said), "{found}");
        assert!(!dir.path().join("runs").exists(), "nothing is written");
    }
}

fn spoil_action(made: &mut Made, row: usize, value: f64) {
    let column = made.column("action");
    let mut values: Vec<f64> = column.as_any().downcast_ref::<Float64Array>().expect("numbers").values().to_vec();
    values[row] = value;
    *column = Arc::new(Float64Array::from(values)) as ArrayRef;
}

fn spoil_index(made: &mut Made, row: usize) {
    let column = made.column("index");
    let mut values: Vec<i64> = column.as_any().downcast_ref::<Int64Array>().expect("numbers").values().to_vec();
    values[row] += 1;
    *column = Arc::new(Int64Array::from(values)) as ArrayRef;
}

#[test]
fn files_that_are_missing_and_flags_that_do_not_go_together_are_named() {
    let dir = tempdir().expect("dir");
    let root = dir.path().join("d");
    made(&LENGTHS).write(&root);
    let bc = ["train", "--method", "bc", "--dataset", "d"];
    for (more, code, said) in [
        (&["--task", "stack"][..], 2, "--task stack: d is a dataset of another program; leave out --task"),
        (&["--robot", "panda"], 2, "--robot panda: d is a dataset of another program"),
        (&["--set", "train.features=fk"], 2, "train.features needs the kinematics of a robot"),
        (&["--set", "train.select_episodes=5"], 2, "needs a simulator"),
        (&["--state", "note"], 1, "has string in column note"),
        (&["--state", "action"], 1, "--state and --action both name action"),
        (&["--dynamics", "missing.safetensors"], 1, "missing.safetensors"),
    ] {
        let found = refused(dir.path(), &[&bc[..], more].concat(), code);
        assert!(found.contains(said), "{found}");
    }
    for method in ["ppo", "bc-rl"] {
        let found = refused(dir.path(), &["train", "--method", method, "--dataset", "d"], 2);
        assert!(found.contains(&format!("--method {method} needs the task's simulator")), "{found}");
    }
    let found = refused(dir.path(), &["train", "--task", "stack", "--state", "a", "--dataset", "nowhere"], 2);
    assert!(found.contains("choose columns of a dataset of another program"), "{found}");
    fs::remove_file(root.join("data/chunk-000/file-000.parquet")).expect("removed");
    let found = refused(dir.path(), &bc, 1);
    assert!(found.contains("file-000.parquet: is missing, but meta/episodes has episodes in it"), "{found}");
    fs::remove_dir_all(root.join("meta/episodes")).expect("removed");
    let found = refused(dir.path(), &bc, 1);
    assert!(found.contains("has no meta/episodes/chunk-000/file-000.parquet"), "{found}");
    made(&[9]).write(&dir.path().join("one"));
    let found = refused(dir.path(), &["pretrain", "--dataset", "one"], 1);
    assert!(found.contains("has one episode; two are needed"), "{found}");
    made(&[9, 1, 9]).write(&dir.path().join("short"));
    let found = refused(dir.path(), &["pretrain", "--dataset", "short"], 1);
    assert!(found.contains("episode 1 has one frame"), "{found}");
}

#[test]
fn damaged_files_are_refused_and_never_panic() {
    let dir = tempdir().expect("dir");
    let root = dir.path().join("d");
    made(&LENGTHS).write(&root);
    for name in ["data/chunk-000/file-000.parquet", "meta/episodes/chunk-000/file-000.parquet", "meta/info.json"] {
        let path = root.join(name);
        let whole = fs::read(&path).expect("bytes");
        for cut in [1, 3, 10, whole.len() / 2, whole.len() - 1] {
            fs::write(&path, &whole[..cut]).expect("cut");
            let read = open(&root, &Choice::default()).and_then(|source| source.read(10, 0).map(drop));
            let why = read.expect_err("refused").to_string();
            assert!(why.contains("d/"), "{why}");
        }
        let stride = (whole.len() / 60).max(1);
        for at in (0..whole.len()).step_by(stride) {
            let mut bytes = whole.clone();
            bytes[at] ^= 1 << (at % 8);
            fs::write(&path, bytes).expect("damaged");
            // It carries no seal: a changed number may be read as such, but nothing breaks.
            let _ = open(&root, &Choice::default()).and_then(|source| source.read(10, 0).map(drop));
        }
        fs::write(&path, whole).expect("restored");
    }
}

#[test]
fn inspect_says_what_it_is() {
    let dir = tempdir().expect("dir");
    made(&LENGTHS).write(&dir.path().join("d"));
    let (out, _) = done(dir.path(), &["inspect", "d", "--json"]);
    let found: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!(
        (&found["kind"], &found["episodes"], &found["frames"]),
        (&json!("dataset of another program"), &json!(6), &json!(59))
    );
    assert_eq!(
        (&found["fps"], &found["tasks"], &found["states"][2]["mean"]),
        (&json!(10.0), &json!(["hold still"]), &json!(7000.0))
    );
    assert!(hilt(dir.path(), &["inspect", "d"]).status.success());
    made(&LENGTHS).without("action").write(&dir.path().join("e"));
    let (out, _) = done(dir.path(), &["inspect", "e"]);
    assert!(out.contains("learning: not as it is: it has no column action"), "{out}");
}

#[test]
fn a_policy_of_a_foreign_dataset_is_not_run_in_a_simulator_of_another_task() {
    let dir = tempdir().expect("dir");
    let data = fixture("lerobot").display().to_string();
    done(dir.path(), &[&["train", "--method", "bc", "--dataset", &data][..], &TINY].concat());
    let said = refused(dir.path(), &["evaluate", "--task", "stack", "--policy", "runs/lerobot/policy-bc.safetensors"], 1);
    assert!(said.contains("was learned from lerobot, a dataset of another program"), "{said}");
    let said = refused(
        dir.path(),
        &[&["train", "--dataset", &data, "--dynamics", "runs/lerobot/policy-bc.safetensors"][..], &TINY].concat(),
        1,
    );
    assert!(said.contains("policy"), "{said}");
}
