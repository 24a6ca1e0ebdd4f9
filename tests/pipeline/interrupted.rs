//! Ctrl-C in every stage: exit code 130 (143 for SIGTERM), a word to the person, no trace in the files.

use crate::runs::{HILT, Run, contents, text};
use hilt::data::{recording, table_file};
use hilt::plan::{from_table, to_table};
use hilt::robot::file::built_in::paper_robot;
use hilt::task::built_in::pick_up;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Into the work, far from its end.
const SOON: Duration = Duration::from_millis(400);
/// From the signal to the end of the process: a few items of work, on a busy machine.
const PATIENCE: Duration = Duration::from_secs(20);
/// Recordings that take seconds to read and to write.
const MANY: usize = 4000;
/// Recordings that take some tenths of a second to write as a dataset.
const DISTINCT: u64 = 200;

pub fn start(words: Vec<String>) -> Child {
    // Tests that run under nohup hand on that a hang-up is ignored.
    Command::new("env")
        .args(["--default-signal=HUP", HILT])
        .args(words)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary runs")
}

pub fn signal(child: &Child, name: &str) {
    let sent = Command::new("kill").args([format!("-{name}"), child.id().to_string()]).status().expect("kill runs");
    assert!(sent.success(), "the process has ended already");
}

/// Sends the signal after a while; expects the end that belongs to it and the run as it was.
fn interrupted_by(name: &str, run: &Run, words: Vec<String>, wait: Duration) {
    let (before, what) = (contents(run.path()), format!("{words:?}"));
    let mut child = start(words);
    std::thread::sleep(wait);
    signal(&child, name);
    let sent = Instant::now();
    while child.try_wait().expect("waits").is_none() && sent.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(5));
    }
    if child.try_wait().expect("waits").is_none() {
        child.kill().expect("killed");
        panic!("{what} did not stop within {PATIENCE:?}");
    }
    let output = child.wait_with_output().expect("ended");
    let stderr = text(&output.stderr);
    assert_eq!(
        output.status.code(),
        Some(128 + [("HUP", 1), ("INT", 2), ("TERM", 15)].iter().find(|(of, _)| *of == name).expect("known").1),
        "{what}: {stderr}"
    );
    assert!(stderr.contains("error: interrupted; no artefact was changed"), "{what}: {stderr}");
    assert!(output.stdout.is_empty(), "{what} printed a result");
    if what.contains("\"train\"") {
        // Training leaves its checkpoint, and nothing else.
        assert!(stderr.contains("policy.checkpoint.safetensors: run the same command with --resume"), "{stderr}");
        fs::remove_file(run.at("policy.checkpoint.safetensors")).expect("the checkpoint");
    }
    // Planning and simulation keep what they have finished, where they have.
    for kept in ["plans.unfinished", "recordings.unfinished"].map(|name| run.at(name)).iter().filter(|dir| dir.exists()) {
        let says = ["episodes are kept in ", kept.file_name().and_then(|n| n.to_str()).expect("a name"), "to go on"];
        assert!(says.iter().all(|part| stderr.contains(part)), "{what}: {stderr}");
        fs::remove_dir_all(kept).expect("removed");
    }
    run.unchanged(&what, &before);
}

fn long(run: &Run, stage: &str, further: &[&str]) -> Vec<String> {
    run.words(stage).into_iter().chain(further.iter().map(|w| w.to_string())).collect()
}

#[test]
fn planning_learning_and_evaluation_stop() {
    let run = Run::finished();
    let policy = run.name("policy.safetensors");
    let by_planner = long(&run, "evaluate", &["--episodes", "100000"]);
    let by_planner = by_planner.into_iter().map(|w| if w == policy { "planner".into() } else { w }).collect();
    for words in [
        long(&run, "plan", &["--episodes", "100000"]),
        long(&run, "pretrain", &["--set", "pretrain.epochs=1000000", "--set", "pretrain.patience=0"]),
        long(&run, "train", &["--set", "train.warm_start_updates=10000000"]),
        long(&run, "train", &["--set", "train.epochs=1000000", "--method", "sc"]),
        long(&run, "evaluate", &["--episodes", "100000"]),
        by_planner,
        long(&run, "evaluate", &["--episodes", "100000", "--record", &run.name("rollouts")]),
    ] {
        interrupted_by("INT", &run, words, SOON);
    }
    interrupted_by("TERM", &run, long(&run, "plan", &["--episodes", "100000"]), SOON);
    // A terminal that is gone: training leaves its checkpoint as well.
    interrupted_by("HUP", &run, long(&run, "train", &["--set", "train.warm_start_updates=10000000"]), SOON);
}

#[test]
fn nohup_keeps_its_meaning() {
    let run = Run::finished();
    let words = long(&run, "plan", &["--episodes", "100000"]);
    let mut child =
        Command::new("nohup").arg(HILT).args(words).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("runs");
    std::thread::sleep(SOON);
    signal(&child, "HUP");
    std::thread::sleep(SOON);
    assert!(child.try_wait().expect("waits").is_none(), "a hang-up ended it");
    signal(&child, "INT");
    assert_eq!(child.wait().expect("ended").code(), Some(130));
}

#[test]
fn waiting_for_a_pipe_stops() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let pipe = |name: &str| {
        let path = dir.path().join(name).display().to_string();
        assert!(Command::new("mkfifo").arg(&path).status().expect("mkfifo runs").success());
        path
    };
    for words in [
        ["robot", "draft", &pipe("a.urdf")],
        ["robot", "check", &pipe("b.toml")],
        ["experiment", "--dry-run", &pipe("c.toml")],
        ["plot", "--watch", &pipe("d.jsonl")],
    ] {
        let mut child = start(words.map(String::from).to_vec());
        std::thread::sleep(SOON);
        signal(&child, "TERM");
        let sent = Instant::now();
        while child.try_wait().expect("waits").is_none() && sent.elapsed() < PATIENCE {
            std::thread::sleep(Duration::from_millis(5));
        }
        let ended = child.try_wait().expect("waits");
        child.kill().expect("killed");
        assert!(ended.is_some(), "{words:?} did not stop");
    }
}

#[test]
fn watching_waits_for_the_first_epoch() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let live = dir.path().join("policy.training.jsonl");
    fs::write(&live, "").expect("written");
    let mut child = start(["plot", "--watch", live.to_str().expect("UTF-8")].map(String::from).to_vec());
    std::thread::sleep(2 * SOON);
    assert!(child.try_wait().expect("waits").is_none(), "it did not wait");
    signal(&child, "INT");
    let output = child.wait_with_output().expect("ended");
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("plot: waits for a training"), "{}", text(&output.stderr));
}

#[test]
fn simulation_stops() {
    let run = Run::finished();
    let path = run.at("plans.parquet");
    let (table, origin) = table_file::read(&path).expect("plans");
    let plan = from_table(&paper_robot(), &pick_up(), &table).expect("plans").swap_remove(0);
    let plans: Vec<_> = (0..1000).map(|index| hilt::plan::Plan { index, ..plan.clone() }).collect();
    table_file::write(&path, &to_table(&paper_robot(), &plans), &origin).expect("written");
    interrupted_by("INT", &run, run.words("simulate"), SOON);
}

/// Many recordings, each a little different.
fn distinct(one: &Path) -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("temporary directory");
    let (mut episode, origin) = recording::read(one).expect("a recording");
    for index in 0..DISTINCT {
        episode.index = index;
        episode.steps[0].commanded[0] += 1e-3;
        recording::write(&dir.path().join(recording::file_name(index)), &episode, &origin).expect("written");
    }
    dir
}

#[test]
fn conversion_and_inspection_stop_while_they_read_and_while_they_write() {
    let run = Run::finished();
    let one = fs::canonicalize(run.at("recordings/episode-00000.mcap")).expect("a recording");
    let many = tempfile::tempdir().expect("temporary directory");
    for index in 0..MANY {
        symlink(&one, many.path().join(format!("episode-{index:05}.mcap"))).expect("linked");
    }
    let name = many.path().to_str().expect("UTF-8 path").to_string();
    let over = |dir: &tempfile::TempDir| -> Vec<String> {
        let name = dir.path().to_str().expect("UTF-8 path");
        long(&run, "convert", &[]).into_iter().map(|w| if w == run.name("recordings") { name.into() } else { w }).collect()
    };
    interrupted_by("INT", &run, over(&many), SOON);
    interrupted_by("INT", &run, vec!["inspect".into(), name], SOON);

    // While the dataset is being written, its unfinished directory stands beside its place.
    let before = contents(run.path());
    let distinct = distinct(&one);
    let child = start(over(&distinct));
    let started = Instant::now();
    let unfinished = |e: &fs::DirEntry| e.path().is_dir() && e.file_name().to_string_lossy().starts_with(".hilt-");
    let writing = || fs::read_dir(run.path()).expect("readable").flatten().any(|e| unfinished(&e));
    while !writing() {
        assert!(started.elapsed() < Duration::from_secs(120), "nothing is being written");
        std::thread::sleep(Duration::from_millis(2));
    }
    signal(&child, "INT");
    let output = child.wait_with_output().expect("ended");
    assert_eq!(output.status.code(), Some(130), "{}", text(&output.stderr));
    run.unchanged("convert while it writes", &before);
}

#[test]
fn drawing_stops() {
    let run = Run::finished();
    let further = |words: Vec<String>, more: &[&str]| words.into_iter().chain(more.iter().map(|w| w.to_string())).collect();
    let large = ["--width", "3000", "--height", "3000", "--every", "1"];
    interrupted_by("INT", &run, further(run.render("--gif", "a.gif"), &large), SOON);
    let tiles = ["--width", "300", "--height", "300", "--columns", "32", "--rows", "32"];
    interrupted_by("INT", &run, further(run.render("--png", "a.png"), &tiles), SOON);
}

#[test]
fn a_signal_that_arrives_twice_at_once_counts_once() {
    let run = Run::finished();
    for name in ["INT", "TERM"] {
        let child = start(long(&run, "train", &["--set", "train.warm_start_updates=10000000"]));
        std::thread::sleep(SOON);
        // As from a terminal or `timeout`: to the group, and once more by `make`. Some find the process, some nobody.
        for _ in 0..20 {
            let _ = Command::new("kill").args([format!("-{name}"), child.id().to_string()]).stderr(Stdio::null()).status();
        }
        let output = child.wait_with_output().expect("ended");
        let stderr = text(&output.stderr);
        assert!(stderr.contains("policy.checkpoint.safetensors: run the same command with --resume"), "SIG{name}: {stderr}");
        fs::remove_file(run.at("policy.checkpoint.safetensors")).expect("the checkpoint");
    }
}

#[test]
fn a_signal_ends_a_process_that_waits_for_its_input() {
    let run = Run::finished();
    let pipe = run.name("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().expect("mkfifo runs").success());
    let over = |stage: &str, name: &str| -> Vec<String> {
        run.words(stage).into_iter().map(|w| if w == run.name(name) { pipe.clone() } else { w }).collect()
    };
    for words in [
        over("simulate", "plans.parquet"),
        over("evaluate", "policy.safetensors"),
        over("train", "dynamics.safetensors"),
        vec!["settings".into(), "--pipeline".into(), pipe.clone()],
    ] {
        let what = format!("{words:?}");
        let mut child = start(words);
        std::thread::sleep(SOON);
        assert!(child.try_wait().expect("waits").is_none(), "{what} did not wait for its input");
        signal(&child, "TERM");
        let sent = Instant::now();
        let output = child.wait_with_output().expect("ended");
        assert_eq!(output.status.code(), Some(143), "{what}: {}", text(&output.stderr));
        assert!(sent.elapsed() < PATIENCE, "{what}");
    }
}
