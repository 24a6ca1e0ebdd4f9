//! The examples for Rust users, and those of every command's help, do what they say.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Output, Stdio};

#[path = "../examples/my_controller.rs"]
mod my_controller;
#[path = "../examples/own_arrays.rs"]
mod own_arrays;

#[test]
fn a_controller_of_ones_own_gets_over_the_block() {
    my_controller::main().expect("it runs");
}

#[test]
fn a_policy_learns_from_ones_own_arrays() {
    own_arrays::main().expect("it runs");
}

/// Learning in a few updates, for commands with settings.
const TINY: &str = "pretrain.epochs=2 train.warm_start_updates=50 train.epochs=1 train.min_updates=0 evaluate.horizon_steps=60";
const WITH_SETTINGS: [&str; 4] = ["pretrain", "train", "evaluate", "serve-env"];

fn hilt(words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hilt"));
    command.args(words);
    command
}

fn help(words: &[&str]) -> String {
    let output = hilt(&[words, &["--help"]].concat()).output().expect("the binary runs");
    assert!(output.status.success(), "{words:?}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// The commands that a help lists.
fn listed(help: &str) -> Vec<String> {
    let lines = help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    let names = lines.filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    names
        .filter_map(|line| line.split([' ', ',']).find(|word| !word.is_empty()))
        .filter(|name| *name != "help")
        .map(String::from)
        .collect()
}

/// Every command that does something, with the examples of its help, in the order of the helps.
fn examples(words: &[&str], found: &mut Vec<(String, Vec<String>)>) {
    let help = help(words);
    let below = listed(&help);
    if below.is_empty() {
        let lines = help.lines().skip_while(|line| !matches!(*line, "Example:" | "Examples:")).skip(1);
        let lines = lines.take_while(|line| line.starts_with("  ")).map(|line| line.trim().to_string());
        found.push((words.join(" "), lines.collect()));
    }
    for name in &below {
        examples(&[words, &[name.as_str()]].concat(), found);
    }
}

/// As a shell runs it in `dir`, where `hilt` is the binary.
fn run(line: &str, dir: &Path) -> Output {
    Command::new("sh").args(["-c", line]).current_dir(dir).output().expect("a shell runs")
}

/// Starts a server, reads its address, ends it.
fn serves(line: &str, dir: &Path) {
    let mut child = Command::new("sh")
        .args(["-c", &format!("exec {line}")])
        .current_dir(dir)
        .stdout(Stdio::piped())
        .spawn()
        .expect("a shell runs");
    let mut said = String::new();
    let read = BufReader::new(child.stdout.take().expect("piped")).read_line(&mut said);
    child.kill().expect("it runs");
    child.wait().expect("it ends");
    assert!(read.is_ok() && said.starts_with("ws://"), "{line}: {said}");
}

#[test]
fn the_examples_of_every_help_run() {
    let mut found = Vec::new();
    examples(&[], &mut found);
    let without: Vec<&String> = found.iter().filter(|(_, lines)| lines.is_empty()).map(|(name, _)| name).collect();
    assert!(without.is_empty(), "no example in the help of {without:?}");
    let dir = tempfile::tempdir().expect("a directory");
    std::fs::write(dir.path().join("observations.jsonl"), "").expect("written");
    // The experiments that a clone of the repository brings along.
    let pipelines = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines");
    std::os::unix::fs::symlink(pipelines, dir.path().join("pipelines")).expect("linked");
    // Episodes are left out of a conversion, no experiment has finished runs that a report could show, or a doctor finds something.
    let also: BTreeMap<&str, i32> = BTreeMap::from([("convert", 3), ("report", 1), ("doctor", 1)]);
    for (name, lines) in &found {
        for line in lines {
            assert!(line.starts_with(&format!("hilt {name}")), "{line} is no example of {name}");
            let tiny = if WITH_SETTINGS.contains(&name.as_str()) { format!(" --sets '{TINY}'") } else { String::new() };
            let rest = line.strip_prefix("hilt").expect("it begins so").replace("--episodes 500", "--episodes 4");
            let (rest, redirected) = match rest.split_once(['<', '>']) {
                Some((before, _)) => (before.to_string(), rest[before.len()..].to_string()),
                None => (rest, String::new()),
            };
            let program = format!("'{}'{rest}{tiny} {redirected}", env!("CARGO_BIN_EXE_hilt"));
            if program.contains("--port") {
                serves(&program.replace("--port 8000", "--port 0").replace("--port 8001", "--port 0"), dir.path());
                continue;
            }
            let output = run(&program, dir.path());
            let code = output.status.code();
            let fine = code == Some(0) || also.get(name.as_str()).is_some_and(|allowed| code == Some(*allowed));
            assert!(fine, "{line}: {code:?}: {}", String::from_utf8_lossy(&output.stderr));
        }
    }
}
