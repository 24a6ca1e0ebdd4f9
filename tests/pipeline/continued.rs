//! `plan` and `simulate` that stop and go on, and their work shared among machines: always the bytes of one undisturbed run.

use crate::interrupted::{signal, start};
use crate::runs::{Run, contents, hilt, text};
use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant};

/// More than one block of plans, and a short last one.
const BLOCKS: [&str; 2] = ["--episodes", "140"];
/// For a busy machine.
const PATIENCE: Duration = Duration::from_secs(120);

/// What becomes of a file's bytes.
type Harm = fn(&[u8]) -> Vec<u8>;

/// The arguments of a stage with further words; the last of a flag counts.
pub fn with(run: &Run, stage: &str, further: &[&str]) -> Vec<String> {
    run.words(stage).into_iter().chain(further.iter().map(|w| w.to_string())).collect()
}

pub fn done(words: Vec<String>) -> String {
    let output = hilt(words);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    text(&output.stderr)
}

/// The pieces of the one run that has some in a directory, by their names.
pub fn pieces(unfinished: &Path) -> BTreeMap<String, PathBuf> {
    let paths = |dir: &Path| fs::read_dir(dir).into_iter().flatten().flatten().map(|e| e.path()).collect::<Vec<_>>();
    let files = paths(unfinished).iter().flat_map(|run| paths(run)).collect::<Vec<_>>();
    let name = |path: &PathBuf| path.file_name().expect("a name").to_str().expect("UTF-8").to_string();
    files.into_iter().map(|path| (name(&path), path)).filter(|(name, _)| !name.starts_with('.')).collect()
}

/// What tells that a file is the same one, untouched.
fn identity(path: &Path) -> (u64, i64, i64) {
    let found = fs::metadata(path).expect("there");
    (found.ino(), found.mtime(), found.mtime_nsec())
}

/// Starts a stage and ends it by a signal as soon as so many pieces are there.
fn stopped(words: Vec<String>, name: &str, unfinished: &Path, count: usize) -> Output {
    let (child, started) = (start(words), Instant::now());
    while pieces(unfinished).len() < count {
        assert!(started.elapsed() < PATIENCE, "there are never {count} pieces");
        std::thread::sleep(Duration::from_millis(2));
    }
    signal(&child, name);
    child.wait_with_output().expect("ended")
}

#[test]
fn killed_planning_goes_on_and_finished_blocks_are_not_planned_again() {
    let (whole, run) = (Run::new("pick-up", 0), Run::new("pick-up", 0));
    done(with(&whole, "plan", &BLOCKS));
    let kept = run.at("plans.unfinished");
    assert_eq!(stopped(with(&run, "plan", &BLOCKS), "KILL", &kept, 1).status.code(), None);
    assert!(!run.at("plans.parquet").exists());
    let before: Vec<_> = pieces(&kept).into_values().map(|path| (identity(&path), path)).collect();

    // A single share of all leaves the pieces to look at.
    let words = done(with(&run, "plan", &[&BLOCKS[..], &["--shard", "1/1", "--threads", "1"]].concat()));
    assert!(words.contains("plan: goes on: ") && words.contains(" of 140 episodes are done"), "{words}");
    assert!(before.iter().all(|(was, path)| identity(path) == *was), "a finished block was planned again");
    assert_eq!(pieces(&kept).len(), 3);
    let words = done(with(&run, "plan", &BLOCKS));
    assert!(words.contains("goes on: 140 of 140 episodes are done"), "{words}");
    run.unchanged("continued planning", &contents(whole.path()));
}

#[test]
fn stopped_simulation_goes_on_and_finished_episodes_are_not_executed_again() {
    let (whole, run) = (Run::finished(), Run::finished());
    for run in [&whole, &run] {
        done(with(run, "plan", &["--episodes", "24"]));
    }
    let all = done(whole.words("simulate"));
    let kept = run.at("recordings.unfinished");
    let old = contents(&run.at("recordings"));
    for (name, code, count) in [("TERM", Some(143), 2), ("KILL", None, 8), ("INT", Some(130), 12)] {
        let output = stopped(run.words("simulate"), name, &kept, count);
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), code, "{stderr}");
        let says =
            ["no artefact was changed", " of 24 episodes are kept in ", "recordings.unfinished", "the same command to go on"];
        assert!(name == "KILL" || says.iter().all(|part| stderr.contains(part)), "{stderr}");
        assert!(contents(&run.at("recordings")) == old, "SIG{name} changed the artefact");
    }
    let before: Vec<_> = pieces(&kept).into_iter().map(|(name, path)| (name, identity(&path))).collect();
    let words = done(run.words("simulate"));
    assert!(words.contains("simulate: goes on: "), "{words}");
    // Kept episodes count: "24 episodes in ..." is said of this process, the rest of all.
    let totals = |words: &str| {
        let line = words.lines().find(|line| line.contains(" control steps, ")).expect("the totals");
        line.split_once(')').expect("a rate").1.to_string()
    };
    assert_eq!(totals(&words), totals(&all));
    for (name, was) in before {
        assert_eq!(identity(&run.at("recordings").join(&name)), was, "{name} was executed again");
    }
    run.unchanged("continued simulation", &contents(whole.path()));
}

/// Copies what is in a directory into another.
fn copy_into(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("made");
    assert!(Command::new("cp").arg("-R").arg(from.join(".")).arg(to).status().expect("cp runs").success());
}

#[test]
fn shards_of_several_machines_copied_together_are_the_bytes_of_one() {
    let (whole, run) = (Run::new("pick-up", 0), Run::new("pick-up", 0));
    let machines = [Run::new("pick-up", 0), Run::new("pick-up", 0)];
    // A box in the way of some: those dropped by either machine are named in the end.
    let boxed = "scene.obstacles=[{center_m=[0.47,0,0.06],size_m=[0.04,0.04,0.12]}]";
    let sets = ["--set", boxed, "--set", "plan.search_iterations=5", "--set", "plan.shortcut_iterations=1", "--episodes", "70"];
    let (mut said, stages) = (Vec::new(), [("plan", &sets[..]), ("simulate", &["--set", boxed, "--episodes", "7"])]);
    for (stage, sets) in stages {
        let kept = format!("{}.unfinished", if stage == "plan" { "plans" } else { "recordings" });
        for (number, machine) in machines.iter().enumerate() {
            if stage == "simulate" {
                fs::copy(whole.at("plans.parquet"), machine.at("plans.parquet")).expect("copied");
            }
            let shard = format!("{}/2", number + 1);
            let words = done(with(machine, stage, &[sets, &["--shard", &shard, "--threads", &shard[..1]]].concat()));
            let says = [format!("shard {shard} is done"), kept.clone(), "without --shard".into()];
            assert!(says.iter().all(|part| words.contains(part)), "{words}");
            copy_into(&machine.at(&kept), &run.at(&kept));
        }
        for run in [&whole, &run] {
            let output = hilt(with(run, stage, sets));
            let words = text(&output.stderr);
            assert_eq!(output.status.code(), Some(if stage == "plan" { 3 } else { 0 }), "{words}");
            said.push(words);
        }
        let parts: &[&str] = if stage == "plan" { &["left out 2 of 70", "episode 40: ", "episode 68: "] } else { &[" solved"] };
        assert!(said[said.len() - 2..].iter().all(|words| parts.iter().all(|part| words.contains(part))), "{said:?}");
        assert!(said[said.len() - 1].contains(if stage == "plan" { "goes on: 70 of 70" } else { "goes on: 7 of 7" }), "{said:?}");
    }
    run.unchanged("shards put together", &contents(whole.path()));
}

#[test]
fn a_piece_that_is_damaged_or_of_another_episode_is_made_again() {
    let run = Run::finished();
    let before = contents(run.path());
    let harms: [Harm; 3] = [
        |bytes| bytes[..bytes.len() / 2].to_vec(),
        |bytes| bytes.iter().enumerate().map(|(i, byte)| byte ^ u8::from(i == bytes.len() / 2)).collect(),
        |_| Vec::new(),
    ];
    for (stage, kept) in [("plan", "plans.unfinished"), ("simulate", "recordings.unfinished")] {
        for harm in harms {
            done(with(&run, stage, &["--shard", "1/1"]));
            let first = pieces(&run.at(kept)).into_values().next().expect("a piece");
            fs::write(&first, harm(&fs::read(&first).expect("a piece"))).expect("damaged");
            let words = done(run.words(stage));
            assert!(words.contains("are made again: 1"), "{words}");
            run.unchanged(stage, &before);
        }
    }
    done(with(&run, "simulate", &["--shard", "1/1"]));
    let all: Vec<_> = pieces(&run.at("recordings.unfinished")).into_values().collect();
    fs::copy(&all[0], &all[1]).expect("copied");
    assert!(done(run.words("simulate")).contains("are made again: 1"));
    run.unchanged("another episode's", &before);
}

#[test]
fn pieces_of_another_run_are_neither_taken_nor_removed_and_it_is_said() {
    let mut run = Run::finished();
    let before = contents(run.path());
    for (stage, kept) in [("plan", "plans.unfinished"), ("simulate", "recordings.unfinished")] {
        done(with(&run, stage, &["--shard", "1/2"]));
        let left: Vec<_> = pieces(&run.at(kept)).into_values().map(|path| (identity(&path), path)).collect();
        assert!(!left.is_empty());
        run.seed = 1;
        let words = done(run.words(stage));
        assert!(words.contains("pieces of another run (seed was 0, now it is 1), which stay"), "{words}");
        assert!(!words.contains("goes on: "), "{words}");
        assert!(left.iter().all(|(was, path)| identity(path) == *was), "{stage} touched another run's pieces");
        run.seed = 0;
        let words = done(run.words(stage));
        assert!(words.contains("goes on: ") && !run.at(kept).exists(), "{words}");
    }
    run.unchanged("the first run", &before);
}

#[test]
fn two_processes_on_one_run_harm_neither_each_other_nor_the_artefact() {
    let run = Run::finished();
    let before = contents(run.path());
    for stage in ["plan", "simulate"] {
        for _ in 0..3 {
            let both = [start(run.words(stage)), start(run.words(stage))];
            let ended = both.map(|child| child.wait_with_output().expect("ended"));
            let codes = ended.each_ref().map(|output| output.status.code());
            let words = ended.each_ref().map(|output| text(&output.stderr));
            assert_eq!(codes, [Some(0); 2], "{words:?}");
            run.unchanged(stage, &before);
        }
    }
}

#[test]
fn shares_that_cannot_be_are_refused() {
    let run = Run::finished();
    for stage in ["plan", "simulate"] {
        for shard in ["0/2", "3/2", "1", "1/0", "half", "-1/2"] {
            run.refuses(with(&run, stage, &["--shard", shard]), &["--shard", "I/N", "2/8"]);
        }
    }
    let to_pipe: Vec<String> =
        run.words("plan").into_iter().map(|w| if w == run.name("plans.parquet") { "/dev/stdout".into() } else { w }).collect();
    run.refuses(to_pipe.into_iter().chain(["--shard", "1/2"].map(String::from)).collect(), &["--shard 1/2", "/dev/stdout"]);
    fs::write(run.at("plans.unfinished"), "years of work").expect("written");
    run.refuses(run.words("plan"), &["plans.unfinished: is a file", "move it away"]);
}

#[test]
fn inspect_says_what_a_directory_of_pieces_is() {
    let run = Run::finished();
    done(with(&run, "simulate", &["--shard", "1/2"]));
    run.refuses(vec!["inspect".into(), run.name("recordings.unfinished")], &["is not finished", "run its command again"]);
}
