//! `hilt dataset`: what it says, what it makes, and that nothing is lost.

use crate::made::{Made, TINY, contents, done, fixture, made, refused, table};
use arrow_array::cast::AsArray;
use arrow_array::types::Int64Type;
use arrow_array::{ArrayRef, Float64Array, Int32Array, Int64Array, StringArray};
use hilt::data::dataset::foreign::{Choice, Root, instructions, open, problems};
use hilt::data::dataset::{self, read};
use hilt::interrupt::Interrupt;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use std::sync::Arc;
use tempfile::{TempDir, tempdir};

const LENGTHS: [usize; 6] = [12, 9, 15, 3, 11, 10];

/// A directory with the dataset `d` in it, without its texts.
fn place() -> TempDir {
    let dir = tempdir().expect("dir");
    made(&LENGTHS).without("note").write(&dir.path().join("d"));
    dir
}

fn lengths(root: &Path) -> Vec<usize> {
    Root::open(root).expect("a dataset").episodes.iter().map(|episode| episode.length).collect()
}

fn sound(root: &Path) {
    assert_eq!(problems(root, &Interrupt::default()).expect("read"), [] as [String; 0], "{}", root.display());
}

#[test]
fn info_answers_first_and_in_json() {
    let dir = place();
    let (out, err) = done(dir.path(), &["dataset", "info", "d"]);
    assert!(out.starts_with("episodes: 6\n") && err.is_empty(), "{out}{err}");
    assert!(out.contains("hold still") && out.contains("observation.state"), "{out}");
    let (out, _) = done(dir.path(), &["dataset", "info", "d", "--json"]);
    let found: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!((&found["frames"], &found["longest_episode"], &found["fps"]), (&json!(60), &json!(15), &json!(10.0)));
    done(dir.path(), &["dataset", "split", "d", "--out", "s"]);
    let (out, _) = done(dir.path(), &["dataset", "info", "s"]);
    assert!(out.contains("train\n") && out.contains("validation\n"), "{out}");
}

#[test]
fn every_problem_is_named_and_a_sound_dataset_has_none() {
    for name in ["lerobot", "edited"] {
        sound(&fixture(name));
        done(Path::new("."), &["dataset", "validate", &fixture(name).display().to_string()]);
    }
    type Spoil = fn(&mut Made);
    let spoilt: [(Spoil, &str); 11] = [
        (|m| numbers(m, "action", 5, f64::NAN), "column action, row 5, entry 0: NaN is not a finite number (0 more"),
        (|m| numbers(m, "timestamp", 17, 9.0), "column timestamp, row 17: 9, expected 0.5"),
        (
            |m| drop(m.info["features"].as_object_mut().expect("features").remove("note")),
            "column note of data/chunk-000/file-000.parquet is not declared",
        ),
        (|m| m.columns.retain(|(name, _)| name != "action"), "column action is declared in meta/info.json, but data/"),
        (
            |m| *m.column("frame_index") = Arc::new(Int32Array::from(vec![0; 60])) as ArrayRef,
            "column frame_index, row 1: 0, expected 1",
        ),
        (
            |m| *m.column("task_index") = Arc::new(Int32Array::from(vec![3; 60])) as ArrayRef,
            "column task_index, row 0: 3 is none of the 1 tasks",
        ),
        (
            // Regression: only the first row that was read at a time was looked at.
            |m| {
                *m.column("task_index") =
                    Arc::new(Int32Array::from_iter_values((0..60).map(|row| i32::from(row == 59)))) as ArrayRef
            },
            "column task_index, row 59: 1 is none of the 1 tasks",
        ),
        (
            |m| {
                m.info["features"]["action"]["dtype"] = json!("float32");
                numbers(m, "action", 31, -1e39);
            },
            "column action, row 31: -1e39 is more than float32 holds",
        ),
        (|m| m.info["total_frames"] = json!(61), "says 6 episodes of 61 frames"),
        (|m| m.info["fps"] = json!(12.5), "fps is a whole number"),
        (
            |m| m.info["features"]["a/b"] = json!({ "dtype": "float32", "shape": [1], "names": null }),
            "column a/b has a / in its name",
        ),
    ];
    let dir = tempdir().expect("dir");
    for (at, (spoil, said)) in spoilt.into_iter().enumerate() {
        let root = dir.path().join(at.to_string());
        let mut dataset = made(&LENGTHS);
        spoil(&mut dataset);
        dataset.write(&root);
        let found = problems(&root, &Interrupt::default()).expect("read");
        assert!(found.iter().any(|what| what.contains(said)), "{said}: {found:#?}");
        // What it has not, it was not given.
        assert!(found.iter().any(|what| what.contains("meta/stats.json is missing")), "{found:#?}");
        let output = crate::made::hilt(dir.path(), &["dataset", "validate", &at.to_string()]);
        let out = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.code() == Some(1) && out.lines().count() == found.len(), "{out}");
    }
}

/// Other words for the tasks of a dataset.
fn words<const N: usize>(root: &Path, words: [Option<&str>; N]) {
    let numbers = Arc::new(Int64Array::from_iter_values(0..N as i64)) as ArrayRef;
    let words = Arc::new(StringArray::from(words.to_vec())) as ArrayRef;
    table(&root.join("meta/tasks.parquet"), &[("task_index".into(), numbers), ("task".into(), words)], 100);
}

fn numbers(made: &mut Made, name: &str, row: usize, value: f64) {
    let column = made.column(name);
    let mut values: Vec<f64> = column.as_any().downcast_ref::<Float64Array>().expect("numbers").values().to_vec();
    values[row] = value;
    *column = Arc::new(Float64Array::from(values)) as ArrayRef;
}

#[test]
fn filter_drop_split_merge_and_convert_write_sound_datasets_of_the_same_numbers() {
    let dir = place();
    let at = |name: &str| dir.path().join(name);
    for (words, out, expected) in [
        (&["filter", "d", "--episodes", "0-2,5", "--min-length", "10"][..], "f", &[12, 15, 10][..]),
        (&["filter", "d", "--success"], "g", &[12, 15, 11]),
        (&["drop", "d", "--episodes", "3", "--columns", "next.success"], "h", &[12, 9, 15, 11, 10]),
        (&["convert", "d"], "c", &LENGTHS),
        (&["merge", "f", "g"], "m", &[12, 15, 10, 12, 15, 11]),
    ] {
        let (_, said) = done(dir.path(), &[&["dataset"], words, &["--out", out]].concat());
        assert!(said.contains(&format!("dataset: wrote {out}: {} ", expected.len())), "{said}");
        assert_eq!(lengths(&at(out)), expected);
        // hilt convert makes timestamps of its own rate; the others keep what stood there, which was right.
        sound(&at(out));
    }
    let demos = |root: &Path| open(root, &Choice::default()).expect("a dataset").read(1, 0).expect("demos");
    let all = |root: &Path| {
        let read = demos(root);
        let mut rows: Vec<Vec<f32>> = read.train.iter().chain(&read.validation).map(|demo| demo.states().to_vec()).collect();
        rows.sort_by(|a, b| a.partial_cmp(b).expect("finite"));
        rows
    };
    assert_eq!(all(&at("c")), all(&at("d")), "convert keeps the numbers");
    let info: Value = serde_json::from_slice(&fs::read(at("c/meta/info.json")).expect("readable")).expect("JSON");
    assert_eq!(info["features"]["observation.state"], json!({ "dtype": "float32", "shape": [3], "names": ["x", "v", "k"] }));
    assert_eq!((&info["fps"], &info["robot_type"]), (&json!(10), &json!("spring")));
    let kept: Value = serde_json::from_slice(&fs::read(at("f/meta/info.json")).expect("readable")).expect("JSON");
    assert_eq!(kept["features"]["observation.state"]["dtype"], json!("float64"), "filter changes no type");
    assert_eq!(
        (&kept["hilt"]["provenance"]["stage"], &kept["hilt"]["provenance"]["settings"]["dataset"]["operation"]),
        (&json!("dataset"), &json!("filter"))
    );
    assert_eq!(
        kept["hilt"]["provenance"]["inputs"]["dataset"].as_str().map(str::len),
        Some(64),
        "the content of what it was made of"
    );

    done(dir.path(), &["dataset", "split", "d", "--out", "s", "--ratio", "2", "--seed", "3"]);
    let (train, validation) = (lengths(&at("s/train")), lengths(&at("s/validation")));
    let mut both = [train.clone(), validation].concat();
    both.sort_unstable();
    assert_eq!((train.len(), both), (4, vec![3, 9, 10, 11, 12, 15]));
    sound(&at("s/train"));
    sound(&at("s/validation"));
    // What was split beforehand is learned from as it is.
    done(dir.path(), &[&["train", "--method", "bc", "--dataset", "s"][..], &TINY].concat());
}

/// Regression: what has no `meta/tasks.parquet` was given the other's task.
#[test]
fn merged_datasets_keep_their_own_tasks() {
    let dir = place();
    made(&[4, 7]).without("note").write(&dir.path().join("bare"));
    fs::remove_file(dir.path().join("bare/meta/tasks.parquet")).expect("removed");
    words(&dir.path().join("d"), [Some("swing")]);
    // meta/episodes says "hold still" of both, the tasks of d another word.
    done(dir.path(), &["dataset", "merge", "d", "bare", "--out", "m"]);
    assert_eq!(instructions(&dir.path().join("m")).expect("tasks"), ["swing", "hold still"]);
    let mut tasks = Vec::new();
    let table = fs::File::open(dir.path().join("m/data/chunk-000/file-000.parquet")).expect("a file");
    for batch in ParquetRecordBatchReaderBuilder::try_new(table).expect("a table").build().expect("a reader") {
        tasks.extend_from_slice(batch.expect("rows")["task_index"].as_primitive::<Int64Type>().values());
    }
    assert_eq!(tasks, [vec![0; 60], vec![1; 11]].concat());
}

#[test]
fn the_same_words_give_the_same_bytes() {
    let (one, other) = (place(), place());
    let files = [(&one, "1"), (&other, "2")].map(|(dir, threads)| {
        done(dir.path(), &["dataset", "split", "d", "--out", "s", "--threads", threads]);
        let below =
            |(path, bytes): (std::path::PathBuf, Vec<u8>)| (path.strip_prefix(dir.path()).expect("below").to_path_buf(), bytes);
        contents(&dir.path().join("s")).into_iter().map(below).collect::<Vec<_>>()
    });
    assert!(files[0] == files[1]);
}

#[test]
fn what_is_hilts_own_stays_it_with_a_seal_and_a_true_provenance() {
    let dir = tempdir().expect("dir");
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/pick-up/dataset/validation").display().to_string();
    sound(Path::new(&own));
    done(dir.path(), &["dataset", "filter", &own, "--min-length", "1", "--out", "kept"]);
    let (before, after) = (read(Path::new(&own)).expect("ours"), read(&dir.path().join("kept")).expect("ours still"));
    assert_eq!((&after.demos, &after.source_episodes, &after.layout), (&before.demos, &before.source_episodes, &before.layout));
    assert_eq!((after.provenance.stage.as_str(), &after.provenance.task), ("dataset", &before.provenance.task));
    assert_eq!(after.provenance.settings["convert"], before.provenance.settings["convert"], "what it is checked by stays");
    sound(&dir.path().join("kept"));
    let path = dir.path().join("kept/data/chunk-000/file-000.parquet");
    let mut bytes = fs::read(&path).expect("bytes");
    bytes[2000] ^= 1;
    fs::write(&path, bytes).expect("damaged");
    assert!(!problems(&dir.path().join("kept"), &Interrupt::default()).expect("read").is_empty());
    // Without one of its columns it is not.
    done(dir.path(), &["dataset", "drop", &own, "--columns", "next.reward", "--out", "less"]);
    assert!(dataset::foreign::is_foreign(&dir.path().join("less")) && !dataset::foreign::is_foreign(Path::new(&own)));
    sound(&dir.path().join("less"));
}

#[test]
fn bad_input_is_refused_and_nothing_is_lost() {
    let dir = place();
    made(&LENGTHS).write(&dir.path().join("text"));
    made(&[4]).without("note").write(&dir.path().join("one"));
    made(&LENGTHS).without("note").without("next.success").write(&dir.path().join("other"));
    let mut turned = made(&LENGTHS).without("note");
    turned.info["features"]["observation.state"]["names"] = json!(["v", "x", "k"]);
    turned.write(&dir.path().join("turned"));
    let mut another = made(&LENGTHS).without("note");
    another.info["robot_type"] = json!("pendulum");
    another.write(&dir.path().join("another"));
    let mut large = made(&LENGTHS).without("note");
    numbers(&mut large, "action", 31, 1e39);
    large.write(&dir.path().join("large"));
    made(&LENGTHS).without("note").write(&dir.path().join("wordless"));
    words(&dir.path().join("wordless"), [None]);
    fs::create_dir(dir.path().join("mine")).expect("made");
    fs::write(dir.path().join("mine/thesis.tex"), "years").expect("written");
    done(dir.path(), &["dataset", "split", "d", "--out", "s"]);
    let before = contents(dir.path());
    for (words, code, said) in [
        (&["info", "nowhere"][..], 1, "nowhere: is no dataset"),
        (&["validate", "nowhere"], 1, "nowhere: has 1 problem"),
        (&["filter", "d", "--out", "x"], 2, "which episodes? give --episodes"),
        (&["filter", "d", "--episodes", "2-1", "--out", "x"], 2, "--episodes \"2-1\" is no list"),
        (&["filter", "d", "--episodes", "6", "--out", "x"], 2, "--episodes names episode 6, but there are 6: 0 to 5"),
        (&["filter", "d", "--min-length", "99", "--out", "x"], 1, "none of 6 episodes is left; nothing was written"),
        (&["filter", "other", "--success", "--out", "x"], 1, "has no column next.success of true and false"),
        (&["filter", "s", "--success", "--out", "x"], 1, "holds the two datasets s/train and s/validation; name one of them"),
        (&["drop", "d", "--out", "x"], 2, "what is to be dropped?"),
        (&["drop", "d", "--columns", "acton", "--out", "x"], 2, "there is no such column; did you mean action?"),
        (&["drop", "d", "--columns", "index", "--out", "x"], 2, "every dataset has this column"),
        (&["drop", "d", "--episodes", "0-5", "--out", "x"], 1, "none of 6 episodes is left"),
        (
            &["convert", "text", "--out", "x"],
            1,
            "has columns that hilt cannot write: note (string); leave them out: hilt dataset drop --columns note",
        ),
        (&["split", "one", "--out", "x"], 1, "has one episode"),
        (&["merge", "d", "other", "--out", "x"], 1, "do not both have a column next.success of 1 bool"),
        (&["merge", "d", "d", "--out", "x"], 1, "is the same dataset as d"),
        // Regression: these went together, and the second's numbers under the first's names.
        (&["merge", "d", "turned", "--out", "x"], 1, "turned: calls entry 0 of column observation.state \"v\", d calls it \"x\""),
        (&["merge", "d", "another", "--out", "x"], 1, "another: is of a robot \"pendulum\", d of \"spring\""),
        (&["convert", "large", "--out", "x"], 1, "action, row 31: has 1e39, single precision holds at most 3.4"),
        (&["info", "wordless"], 1, "has a task without words"),
        (&["convert", "d", "--out", "d"], 2, "--out d: is d, which this command reads"),
        (&["convert", "d", "--out", "d/inner"], 2, "lies in d"),
        (&["convert", "d", "--out", "other"], 2, "--out other: holds a dataset that hilt did not write, which would be lost"),
        (&["split", "one", "--out", "mine"], 1, "mine: holds \"thesis.tex\""),
        (&["convert", "d", "--out", "s"], 1, "s: holds \""),
    ] {
        let found = refused(dir.path(), &[&["dataset"], words].concat(), code);
        assert!(found.contains(said), "{words:?}: {found}");
        assert!(contents(dir.path()) == before, "{words:?} has changed something");
    }
    // Dropping what cannot be written is how it can be.
    done(dir.path(), &["dataset", "drop", "text", "--columns", "note", "--out", "x"]);
    sound(&dir.path().join("x"));
    // What hilt dataset made, it may make again.
    done(dir.path(), &["dataset", "convert", "d", "--out", "x"]);
    assert_eq!(lengths(&dir.path().join("x")), LENGTHS);
}
