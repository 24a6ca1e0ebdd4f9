//! Runs as they are looked at: `hilt inspect RUN`, `hilt runs`, `hilt compare`, `hilt plot`, `hilt export csv` and `tensorboard`, `hilt train --live`.

use crate::interrupted::{signal, start};
use crate::runs::{Run, hilt, text};
use hilt::data::{recording, table_file};
use hilt::table::Values;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

fn words(words: &[&str]) -> Vec<String> {
    words.iter().map(|word| word.to_string()).collect()
}

/// What a command prints; it must succeed.
fn said(arguments: &[&str]) -> String {
    let output = hilt(words(arguments));
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

fn json(arguments: &[&str]) -> Value {
    serde_json::from_str(&said(&[arguments, &["--json"]].concat())).expect("JSON")
}

fn standing<'a>(run: &'a Value, name: &str) -> &'a Value {
    run["stages"]
        .as_array()
        .expect("stages")
        .iter()
        .find(|stage| stage["name"] == name)
        .unwrap_or_else(|| panic!("no {name}: {run}"))
}

/// A second method in the run.
fn with_bc(run: &Run) {
    for (stage, from, to) in
        [("train", "policy.safetensors", "policy-bc.safetensors"), ("evaluate", "evaluation.json", "evaluation-bc.json")]
    {
        let rename = |word: String| if word.ends_with(from) { word.replace(from, to) } else { word };
        let mut words: Vec<String> = run.words(stage).into_iter().map(rename).collect();
        match stage {
            "train" => words.extend(["--method".into(), "bc".into()]),
            _ => words.iter_mut().for_each(|word| *word = word.replace("policy.safetensors", "policy-bc.safetensors")),
        }
        let output = hilt(words);
        assert!(output.status.success(), "{}", text(&output.stderr));
    }
}

#[test]
fn a_run_by_hand_is_whole_until_something_in_it_is_made_again() {
    let run = Run::finished();
    with_bc(&run);
    let at = run.path().to_str().expect("UTF-8 path");
    let found = json(&["inspect", at]);
    let conditions = |found: &Value| {
        let stages = found["stages"].as_array().expect("stages").clone();
        stages
            .iter()
            .map(|s| format!("{} {}", s["name"].as_str().expect("a name"), s["condition"].as_str().expect("a word")))
            .collect::<Vec<_>>()
    };
    let all = ["plan", "simulate", "convert", "pretrain", "train", "train-bc", "evaluate", "evaluate-bc"];
    let mut sorted = conditions(&found);
    sorted.sort();
    let mut expected = all.map(|name| format!("{name} whole")).to_vec();
    expected.sort();
    assert_eq!(sorted, expected);
    let methods: Vec<&str> = found["evaluations"].as_array().expect("some").iter().filter_map(|e| e["method"].as_str()).collect();
    assert_eq!(methods, ["hil", "bc"]);
    let words = said(&["inspect", at]);
    assert!(words.starts_with("pick-up by hil: success ") && words.contains("\npick-up by bc: success "), "{words}");

    // Another plan: what was made from the old one is stale, the policies of it too.
    let again = run.words("plan").into_iter().map(|word| if word == "0" { "5".into() } else { word }).collect();
    assert!(hilt(again).status.success());
    fs::remove_file(run.at("evaluation-bc.json")).expect("removed");
    let found = json(&["inspect", at]);
    assert_eq!(standing(&found, "simulate")["why"], "it was made from another plans.parquet");
    assert_eq!(standing(&found, "train-bc")["condition"], "stale");
    assert_eq!(standing(&found, "evaluate")["why"], "it follows train, which is stale");

    // Cut short, and half of a run.
    let bytes = fs::read(run.at("dynamics.safetensors")).expect("readable");
    fs::write(run.at("dynamics.safetensors"), &bytes[..bytes.len() / 2]).expect("written");
    fs::remove_file(run.at("evaluation.json")).expect("removed");
    let found = json(&["inspect", at]);
    let named =
        |stage: &str| found["stages"].as_array().expect("stages").iter().find(|s| s["stage"] == stage).expect("a stage").clone();
    assert_eq!(
        (named("pretrain")["condition"].clone(), named("evaluate")["condition"].clone()),
        ("damaged".into(), "missing".into())
    );
    assert!(said(&["inspect", at]).starts_with("pick-up: nothing is evaluated yet\n"));
}

#[test]
fn runs_are_listed_with_what_differs_and_compared_by_episode() {
    let (run, root) = (Run::finished(), tempfile::tempdir().expect("temporary directory"));
    with_bc(&run);
    let place = root.path().join("deep/below/pick-up");
    fs::create_dir_all(place.parent().expect("a parent")).expect("made");
    assert!(std::process::Command::new("cp").arg("-R").arg(run.path()).arg(&place).status().expect("cp").success());
    let at = |path: &Path| path.to_str().expect("UTF-8 path").to_string();
    let found = json(&["runs", &at(root.path())]);
    let rows = found["runs"].as_array().expect("rows");
    assert_eq!(rows.len(), 2);
    assert!(rows.iter().all(|row| row["demos"].as_u64().expect("demos") >= 2 && row["summary"]["episodes"] == 2), "{found}");
    let methods: Vec<&str> = rows.iter().filter_map(|row| row["method"].as_str()).collect();
    assert!(methods.contains(&"hil") && methods.contains(&"bc"), "{methods:?}");

    let table = said(&["runs", &at(root.path())]);
    assert!(table.starts_with("run ") && table.contains("deep/below/pick-up/evaluation-bc.json"), "{table}");

    let place = at(&place);
    let pair = [format!("{place}:hil"), format!("{place}:bc")];
    let found = json(&["compare", &pair[0], &pair[1]]);
    assert_eq!((&found["paired"], &found["first"]["of"]), (&true.into(), &2.into()));
    let pairs = &found["pairs"];
    let counts: u64 = ["both", "only_first", "only_second", "neither"].iter().filter_map(|key| pairs[key].as_u64()).sum();
    assert_eq!(counts, 2);
    assert!(found["settings"].as_array().expect("some").iter().any(|d| d["key"] == "method"), "{found}");
    // A run of two methods needs no second name, and the tables themselves are as good.
    assert_eq!(json(&["compare", &place])["pairs"]["both"], pairs["both"]);
    let tables = ["evaluation.json", "evaluation-bc.episodes.parquet"].map(|name| format!("{place}/{name}"));
    assert_eq!(json(&["compare", &tables[0], &tables[1]])["newcombe_95"], found["newcombe_95"]);
}

#[test]
fn metrics_as_they_come_are_those_of_the_table_also_after_a_training_that_went_on() {
    let run = Run::finished();
    let (live, board) = (run.name("policy.training.jsonl"), run.name("board"));
    let long = ["--set", "train.warm_start_updates=4000", "--set", "train.bc_batch=64", "--set", "train.epochs=40"];
    let training =
        |further: &[&str]| run.words("train").into_iter().chain(words(&long)).chain(words(further)).collect::<Vec<_>>();
    let both = ["--live", &live, "--tensorboard", &board];
    let child = start(training(&both));
    let began = Instant::now();
    while fs::read_to_string(&live).unwrap_or_default().lines().count() < 5 {
        assert!(began.elapsed() < Duration::from_secs(60), "no metrics come");
        std::thread::sleep(Duration::from_millis(2));
    }
    signal(&child, "INT");
    let output = child.wait_with_output().expect("ended");
    assert_eq!(output.status.code(), Some(130), "{}", text(&output.stderr));
    let drawn = said(&["plot", &live, "--metric", "l_bc"]);
    assert!(drawn.contains("l_bc"), "{drawn}");
    let output = hilt(training(&[&both[..], &["--resume"]].concat()));
    assert!(output.status.success() && text(&output.stderr).contains("continues after"), "{}", text(&output.stderr));

    let (table, _) = table_file::read(&run.at("policy.training.parquet")).expect("a table");
    let lines = fs::read_to_string(&live).expect("readable");
    assert_eq!(lines.lines().count(), table.rows());
    let (Values::F64(l_bc), Values::I64(epochs)) =
        (&table.column("l_bc").expect("a column").values, &table.column("epoch").expect("a column").values)
    else {
        panic!("other columns")
    };
    for (row, line) in lines.lines().enumerate() {
        let found: Value = serde_json::from_str(line).expect("JSON");
        assert_eq!((found["epoch"].as_i64(), found["l_bc"].as_f64()), (Some(epochs[row]), Some(l_bc[row])));
    }
    // What TensorBoard gets as it comes is what it gets afterwards, to the byte.
    let out = run.name("exported");
    said(&["export", "tensorboard", &run.name("policy.training.parquet"), "--out", &out]);
    let file = |dir: &str| fs::read(Path::new(dir).join("events.out.tfevents.0.hilt")).expect("events");
    assert!(file(&board) == file(&format!("{out}/hil")));
    said(&["export", "tensorboard", &run.name(""), "--out", &out]);
    assert!(Path::new(&out).join("dynamics").is_dir(), "another export takes the place of the first");
}

#[test]
fn a_pretraining_is_watched_like_a_training() {
    let run = Run::finished();
    let (live, board) = (run.name("dynamics.pretraining.jsonl"), run.name("board"));
    let words = run.words("pretrain").into_iter().chain(words(&["--live", &live, "--tensorboard", &board])).collect::<Vec<_>>();
    let output = hilt(words);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let (table, _) = table_file::read(&run.at("dynamics.pretraining.parquet")).expect("a table");
    let Values::F64(l_model) = &table.column("l_model").expect("a column").values else { panic!("numbers") };
    let lines = fs::read_to_string(&live).expect("readable");
    let found: Vec<Option<f64>> =
        lines.lines().map(|line| serde_json::from_str::<Value>(line).expect("JSON")["l_model"].as_f64()).collect();
    assert_eq!(found, l_model.iter().map(|loss| Some(*loss)).collect::<Vec<_>>());
    assert!(said(&["plot", &live]).contains("l_model"));
    let out = run.name("exported");
    said(&["export", "tensorboard", &run.name("dynamics.pretraining.parquet"), "--out", &out]);
    let events = |dir: &str| fs::read(Path::new(dir).join("events.out.tfevents.0.hilt")).expect("events");
    assert!(events(&board) == events(&format!("{out}/dynamics")));
}

#[test]
fn what_is_exported_as_csv_is_what_the_files_hold() {
    let run = Run::finished();
    let of = |name: &str| said(&["export", "csv", &run.name(name)]);
    let table = of("evaluation.episodes.parquet");
    assert!(
        table.starts_with("episode,success,failure,steps,reward,hit_obstacle,block.x_m,") && table.lines().count() == 3,
        "{table}"
    );
    let (found, _) = table_file::read(&run.at("evaluation.episodes.parquet")).expect("a table");
    let Values::F64(x) = &found.column("block.x_m").expect("a column").values else { panic!("numbers") };
    let read: Vec<f64> =
        table.lines().skip(1).map(|line| line.split(',').nth(6).and_then(|cell| cell.parse().ok()).expect("a number")).collect();
    assert_eq!(&read, x, "every bit of a number comes back");

    let steps = of("recordings/episode-00000.mcap");
    let (episode, _) = recording::read(&run.at("recordings/episode-00000.mcap")).expect("a recording");
    let lines: Vec<Vec<&str>> = steps.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(lines.len(), episode.steps.len() + 2);
    assert!(lines.iter().all(|line| line.len() == lines[0].len()), "every line has a cell a column");
    let column =
        |name: &str| lines[0].iter().position(|found| *found == name).unwrap_or_else(|| panic!("no {name} in {:?}", lines[0]));
    let cell = |line: usize, name: &str| lines[line][column(name)].to_string();
    assert_eq!(cell(2, "time_s"), "0.05");
    assert_eq!(cell(3, "commanded.joint_2.velocity_rad_s").parse(), Ok(episode.steps[2].commanded[1]));
    assert_eq!(cell(lines.len() - 1, "commanded.joint_2.velocity_rad_s"), "");
    assert_eq!(cell(1, "phase"), "approach");

    let frames = of("dataset/validation");
    let info: Value =
        serde_json::from_slice(&fs::read(run.at("dataset/validation/meta/info.json")).expect("read")).expect("JSON");
    let rows = info["total_frames"].as_u64().expect("frames") + info["total_episodes"].as_u64().expect("episodes");
    assert_eq!(frames.lines().count() as u64, rows + 1, "a row a frame, and the last state of each episode");
    assert!(frames.starts_with("episode,source_episode,step,time_s,joint_1.q_rad,"), "{}", &frames[..80]);

    let out = run.name("steps.csv");
    said(&["export", "csv", &run.name("recordings/episode-00000.mcap"), "--out", &out]);
    assert_eq!(fs::read_to_string(&out).expect("written"), steps);
}

#[test]
fn a_plot_is_plain_where_nothing_else_is_known_of_the_reader_and_a_picture_parses() {
    let run = Run::finished();
    let at = run.path().to_str().expect("UTF-8 path");
    let mut plain = std::process::Command::new(crate::runs::HILT);
    let plain = plain.args(["plot", at]).env("LANG", "C").env_remove("LC_ALL").env_remove("LC_CTYPE").output().expect("runs");
    let drawn = text(&plain.stdout);
    assert!(plain.status.success() && drawn.is_ascii() && drawn.lines().all(|line| line.len() <= 80), "{drawn}");
    for metric in ["d_conv", "alpha", "l_bc", "l_model"] {
        assert!(drawn.contains(metric), "{metric} is not drawn: {drawn}");
    }
    let out = run.name("curves.svg");
    said(&["plot", at, "--metric", "l_bc", "--out", &out]);
    let svg = fs::read_to_string(&out).expect("written");
    let document = roxmltree::Document::parse(&svg).expect("XML");
    assert_eq!(document.descendants().filter(|n| n.attribute("class") == Some("curve")).count(), 1);

    // The errors of the dynamics network stand below the curves, and are a picture of their own.
    assert!(drawn.contains("model error after 10 steps, as a share") && drawn.contains("arm_q"), "{drawn}");
    let errors = run.name("dynamics.errors.parquet");
    let (table, _) = table_file::read(Path::new(&errors)).expect("a table");
    said(&["plot", &errors, "--out", &out]);
    let svg = fs::read_to_string(&out).expect("written");
    let document = roxmltree::Document::parse(&svg).expect("XML");
    let marks = document.descendants().filter(|n| n.attribute("class").is_some_and(|class| class.contains("mean"))).count();
    assert!(marks > table.rows() && marks <= 2 * table.rows(), "{marks} marks for {} groups", table.rows());
}

#[test]
fn what_cannot_be_looked_at_is_refused_with_what_to_do() {
    let run = Run::finished();
    let at = run.name("");
    let empty = tempfile::tempdir().expect("temporary directory");
    let empty = empty.path().to_str().expect("UTF-8 path");
    fs::write(run.at("notes.csv"), "years of work\n").expect("written");
    fs::write(run.at("notes.jsonl"), "years of work\n").expect("written");
    fs::write(run.at("notes.svg"), "years of work\n").expect("written");
    let name = |name: &str| run.name(name);
    let refuses = |arguments: &[&str], says: &[&str]| run.refuses(words(arguments), says);
    refuses(&["inspect", empty], &["neither a run, a dataset nor a directory of recordings"]);
    refuses(&["runs", empty], &["holds no run", "make all"]);
    refuses(&["runs", &name("missing")], &["missing", "cannot read"]);
    refuses(&["compare", &name("missing"), &at], &["missing", "cannot read"]);
    refuses(&["compare", &at], &["has 1 evaluations", "name the one to compare with"]);
    refuses(&["compare", &format!("{at}:bc"), &at], &["has no evaluation of bc", "evaluation.json (hil)"]);
    refuses(&["compare", &format!("{at}:bcc"), &at], &["unknown method \"bcc\"", "did you mean bc?"]);
    refuses(&["compare", &name("plans.parquet"), &at], &["is a table of hilt plan", "evaluation.json"]);
    refuses(&["compare", empty, &at], &["holds no run"]);
    refuses(&["plot", &name("plans.parquet")], &["is no table of epochs", "policy.training.parquet"]);
    refuses(&["plot", &name("policy.safetensors")], &["holds no metrics of a training"]);
    refuses(&["plot", empty], &["holds no metrics of a training", "hilt runs"]);
    refuses(&["plot", &at, "--metric", "d_convv"], &["--metric d_convv", "did you mean d_conv?"]);
    refuses(&["plot", &at, "--out", &name("curves.png")], &["must end in .svg"]);
    refuses(&["plot", &at, "--out", &name("notes.svg")], &["is there already"]);
    refuses(&["plot", &name("notes.jsonl")], &["line 1 is no epoch of a training"]);
    refuses(&["plot", &name("dynamics.errors.parquet"), "--metric", "l_bc"], &["--metric chooses curves of trainings"]);
    refuses(&["plot", &at, &name("dynamics.errors.parquet"), "--out", &name("both.svg")], &["name one kind"]);
    fs::copy(name("evaluation.episodes.parquet"), name("other.errors.parquet")).expect("copied");
    refuses(&["plot", &name("other.errors.parquet")], &["holds no errors of a dynamics network"]);
    refuses(&["plot", "--watch", &at, &at], &["--watch follows one training"]);
    refuses(&["export", "csv", &name("policy.safetensors")], &["is neither a table (Parquet), a recording (MCAP) nor a dataset"]);
    refuses(&["export", "csv", &name("dataset")], &["holds two datasets", "dataset/train"]);
    refuses(&["export", "csv", &name("plans.parquet"), "--out", &name("notes.csv")], &["is there already", "would be lost"]);
    refuses(&["export", "csv", &name("plans.parquet"), "--out", &name("plans.parquet")], &["must end in .csv"]);
    refuses(&["export", "tensorboard", &at, "--out", &name("recordings")], &["recordings"]);
    refuses(&["export", "tensorboard", &name("plans.parquet"), "--out", &name("board")], &["is no table of epochs"]);
    let with = |flag: &str, value: &str| run.words("train").into_iter().chain(words(&[flag, value])).collect::<Vec<_>>();
    run.refuses(with("--live", &name("notes.jsonl")), &["--live", "is there already"]);
    run.refuses(with("--live", &name("live.parquet")), &["must end in .jsonl"]);
    run.refuses(with("--tensorboard", &name("dataset")), &["--tensorboard", "dataset"]);
    // A damaged evaluation is named, and nothing is compared.
    let path = run.at("evaluation.episodes.parquet");
    let bytes = fs::read(&path).expect("readable");
    fs::write(&path, &bytes[..bytes.len() - 9]).expect("cut");
    refuses(&["compare", &name("evaluation.json"), &at], &["evaluation.episodes.parquet"]);
    fs::remove_file(&path).expect("removed");
    refuses(&["compare", &name("evaluation.json"), &at], &["evaluation.episodes.parquet: is missing", "hilt evaluate --out"]);
}
