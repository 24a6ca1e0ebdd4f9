//! What makes the command line easy: what is not said is taken from what is there, texts for shells and people, colours where they are wanted.

use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const POLICY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/pick-up/policy.safetensors");
const PLANS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/pick-up/plans.parquet");
const RECORDING: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/pick-up/recordings/episode-00000.mcap");
const COFFEE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/tasks/coffee.toml");

fn hilt(dir: &Path, words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hilt")).args(words).current_dir(dir).output().expect("the binary runs")
}

fn ok(dir: &Path, words: &[&str]) -> String {
    let output = hilt(dir, words);
    assert_eq!(output.status.code(), Some(0), "{words:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("UTF-8")
}

fn refused(dir: &Path, words: &[&str], code: i32, parts: &[&str]) {
    let output = hilt(dir, words);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{words:?}: {said}");
    parts.iter().for_each(|part| assert!(said.contains(part), "{words:?} should say \"{part}\": {said}"));
}

#[test]
fn the_task_and_the_robot_are_those_of_the_artefact() {
    let dir = tempfile::tempdir().expect("a directory");
    let at = dir.path();
    let said: Value =
        serde_json::from_str(&ok(at, &["evaluate", "--policy", POLICY, "--episodes", "1", "--json"])).expect("JSON");
    assert_eq!(said["task"], "pick-up");
    refused(
        at,
        &["evaluate", "--policy", POLICY, "--task", "stack"],
        1,
        &["was made for task pick-up, but task stack is asked for"],
    );
    refused(at, &["evaluate", "--policy", "missing.safetensors"], 1, &["missing.safetensors"]);
    refused(at, &["evaluate", "--policy", "planner"], 2, &["which task? give --task"]);
    refused(at, &["evaluate"], 2, &["which task? give --task"]);
    ok(at, &["simulate", "--plans", PLANS, "--episodes", "1", "--set", "simulate.pulses.probability=0", "--out", "recordings"]);
    let made: Value = serde_json::from_str(&ok(at, &["inspect", "recordings/episode-00000.mcap", "--json"])).expect("JSON");
    assert_eq!(made["provenance"]["task"], "pick-up");
    // A robot that comes with hilt, which only the plans name.
    ok(at, &["plan", "--task", "stack", "--robot", "panda", "--episodes", "1", "--out", "panda.parquet"]);
    ok(at, &["simulate", "--plans", "panda.parquet", "--out", "panda"]);
    let made: Value = serde_json::from_str(&ok(at, &["inspect", "panda/episode-00000.mcap", "--json"])).expect("JSON");
    assert_eq!((&made["provenance"]["task"], &made["robot"]), (&"stack".into(), &"panda".into()));
    refused(at, &["simulate", "--plans", "panda.parquet", "--robot", "ur5e", "--out", "other"], 1, &["panda.parquet", "panda"]);
    // What a task's own file says no artefact can.
    ok(at, &["plan", "--task", COFFEE, "--episodes", "1", "--out", "coffee.parquet"]);
    refused(
        at,
        &["simulate", "--plans", "coffee.parquet"],
        2,
        &["was made for", "which does not come with hilt", "--task FILE.toml"],
    );
}

#[test]
fn what_a_hilt_toml_says_counts_below_it_and_flags_win() {
    let dir = tempfile::tempdir().expect("a directory");
    let below = dir.path().join("a/b");
    fs::create_dir_all(&below).expect("made");
    let write = |text: &str| fs::write(dir.path().join("hilt.toml"), text).expect("written");
    let train = |words: &[&str], key: &str| {
        let said = ok(&below, &[&["settings"], words].concat());
        let value = said.lines().find_map(|line| line.strip_prefix(&format!("{key} = ")).map(String::from));
        value.unwrap_or_else(|| panic!("{key} in {said}"))
    };
    write("task = \"stack\"\nrobot = \"panda\"\n[train]\ntau = 0.07\nrho = 0.4\n");
    assert_eq!((train(&[], "tau"), train(&[], "robot")), ("0.07".into(), "\"panda\"".into()));
    assert_eq!(train(&["--task", "pick-up", "--robot", "jaco"], "tau"), "0.07", "flags change what they say alone");
    assert_eq!(train(&["--preset", "paper", "--set", "train.rho=0.1"], "rho"), "0.1");
    // All settings are said, or none is to be looked for: make and experiments do the one and the other.
    let whole = concat!(env!("CARGO_MANIFEST_DIR"), "/pipelines/stack.toml");
    for words in [&["--pipeline", whole][..], &["--config", "none", "--task", "stack"]] {
        assert_ne!(train(words, "tau"), "0.07", "{words:?}");
    }
    let own = dir.path().join("hilt.toml").display().to_string();
    assert_eq!(train(&["--pipeline", whole, "--config", &own], "tau"), "0.07");
    let said = String::from_utf8(hilt(&below, &["settings"]).stderr).expect("UTF-8");
    assert!(said.contains(&format!("settings: also those of {own}")), "{said}");

    // An artefact says its task and robot better; one of a task of a file is found by the file.
    let evaluate = |words: &[&str]| ok(&below, &[&["evaluate", "--episodes", "1", "--json"], words].concat());
    let said: Value = serde_json::from_str(&evaluate(&["--policy", POLICY])).expect("JSON");
    assert_eq!(said["task"], "pick-up");
    write(&format!("task = \"{COFFEE}\"\n[evaluate]\nepisodes = 1\n"));
    ok(&below, &["plan", "--episodes", "1", "--out", "coffee.parquet"]);
    ok(&below, &["simulate", "--plans", "coffee.parquet", "--out", "coffee"]);

    write("[train]\nepoch = 7\n");
    refused(&below, &["settings", "--task", "stack"], 2, &["hilt.toml: unknown key train.epoch", "did you mean train.epochs?"]);
    refused(&below, &["doctor"], 1, &["1 of"]);
    ok(&below, &["settings", "--task", "stack", "--config", "none"]);
    refused(&below, &["settings", "--task", "stack", "--config", "missing.toml"], 1, &["missing.toml"]);
    write("task = \"nope\"\n");
    refused(&below, &["settings"], 2, &["hilt.toml: task: ", "nope"]);
    fs::remove_file(dir.path().join("hilt.toml")).expect("removed");
    // A link that leads nowhere says something, and is not passed over.
    std::os::unix::fs::symlink("../gone/hilt.toml", dir.path().join("hilt.toml")).expect("linked");
    refused(&below, &["settings", "--task", "stack"], 1, &["hilt.toml: cannot read"]);
    fs::remove_file(dir.path().join("hilt.toml")).expect("removed");
    write("task = \"stack\"\n");
    // No output of a command may take its place.
    refused(&below, &["plan", "--episodes", "1", "--out", "../../hilt.toml"], 2, &["hilt.toml"]);
}

#[test]
fn a_drawing_is_of_the_format_that_its_name_says() {
    let dir = tempfile::tempdir().expect("a directory");
    let small = ["--width", "64", "--height", "48", "--every", "50"];
    for (name, head) in [("a.gif", &b"GIF8"[..]), ("a.png", &b"\x89PNG"[..])] {
        ok(dir.path(), &[&["render", RECORDING, "--out", name], &small[..]].concat());
        assert!(fs::read(dir.path().join(name)).expect("drawn").starts_with(head), "{name}");
    }
    refused(dir.path(), &["render", RECORDING, "--out", "a.bmp"], 2, &["--gif, --png or --html, or --out"]);
    refused(dir.path(), &["render", RECORDING], 2, &["--gif, --png or --html, or --out"]);
    refused(dir.path(), &["render", RECORDING, "--gif", "--out", "a.png"], 2, &["its name must end in .gif"]);
    refused(dir.path(), &["render", RECORDING, "--gif", "--png"], 2, &["cannot be used with"]);
}

#[test]
fn a_urdf_is_written_of_a_robot_and_of_a_recording_and_never_over_anothers() {
    let dir = tempfile::tempdir().expect("a directory");
    let at = dir.path();
    ok(at, &["export", "urdf", "panda"]);
    ok(at, &["export", "urdf", RECORDING, "--out", "scene.urdf"]);
    let links = |name: &str| {
        let text = fs::read_to_string(at.join(name)).expect("written");
        let document = roxmltree::Document::parse(&text).expect("XML");
        let links = document.root_element().children().filter(|c| c.has_tag_name("link"));
        links.map(|link| link.attribute("name").expect("a name").to_string()).collect::<Vec<_>>()
    };
    assert!(links("panda.urdf").contains(&"hilt_tool".to_string()));
    assert_eq!(links("scene.urdf").first().map(String::as_str), Some("world"));
    assert!(links("scene.urdf").contains(&"object/block".to_string()));
    ok(at, &["export", "urdf", "ur5e", "--out", "panda.urdf"]);
    fs::write(at.join("mine.urdf"), "<?xml version=\"1.0\"?><robot name=\"mine\"/>").expect("written");
    refused(at, &["export", "urdf", "panda", "--out", "mine.urdf"], 2, &["mine.urdf", "would be lost"]);
    assert!(fs::read_to_string(at.join("mine.urdf")).expect("there").contains("mine"));
    refused(at, &["export", "urdf", "pandda"], 2, &["unknown robot", "did you mean panda?"]);
    refused(at, &["export", "urdf", "a.parquet"], 2, &["a.parquet", "FILE.mcap"]);
    refused(at, &["export", "urdf", "a.mcap"], 1, &["a.mcap"]);
    refused(at, &["export", "urdf", PLANS], 2, &["plans.parquet", "FILE.mcap"]);
    refused(at, &["export", "urdf", "panda", "--out", "panda.xml"], 2, &["must end in .urdf"]);
    fs::write(at.join("cut.mcap"), &fs::read(RECORDING).expect("there")[..5000]).expect("written");
    refused(at, &["export", "urdf", "cut.mcap"], 1, &["cut.mcap", "cut short"]);
    assert!(!at.join("cut.urdf").exists());
}

#[test]
fn settings_are_explained() {
    let dir = tempfile::tempdir().expect("a directory");
    let said = ok(dir.path(), &["settings", "--explain", "train.tau"]);
    assert!(said.starts_with("train.tau\n  tau: error of the mean action") && said.contains("\n  default: 0.5\n"), "{said}");
    let all = ok(dir.path(), &["settings", "--explain"]);
    let shown = ok(dir.path(), &["settings", "--task", "stack"]);
    let keys = shown.lines().filter(|line| line.contains(" = ")).count();
    // `task` and `robot` are no keys of a section.
    assert_eq!(all.lines().filter(|line| !line.is_empty() && !line.starts_with(' ')).count(), keys - 2);
    refused(dir.path(), &["settings", "--explain", "train.ta"], 2, &["unknown key", "did you mean train.tau?"]);
    refused(dir.path(), &["settings", "--explain", "train.tau", "--task", "stak"], 2, &["did you mean stack?"]);
    refused(dir.path(), &["settings", "--explain", "train.tau", "--stage", "train"], 2, &["cannot be used with"]);
}

#[test]
fn shells_and_manuals_get_every_command() {
    let dir = tempfile::tempdir().expect("a directory");
    let at = dir.path();
    for shell in ["bash", "zsh", "fish"] {
        let text = ok(at, &["completions", shell]);
        assert!(["pretrain", "serve-env", "--robot"].iter().all(|word| text.contains(word.trim_start_matches("--"))), "{shell}");
    }
    refused(at, &["completions", "sh"], 2, &["sh", "bash"]);
    ok(at, &["man", "man1"]);
    ok(at, &["man", "man1"]);
    let page = fs::read_to_string(at.join("man1/hilt-train.1")).expect("a page");
    assert!(page.contains(".TH hilt-train 1") && page.contains("Examples:"), "{page}");
    assert!(at.join("man1/hilt.1").exists() && at.join("man1/hilt-dataset-filter.1").exists());
    fs::create_dir(at.join("others")).expect("made");
    fs::write(at.join("others/hilt.1"), ".TH hilt 1 of another program\n").expect("written");
    refused(at, &["man", "others"], 2, &["others/hilt.1", "would be lost"]);
    assert_eq!(fs::read_dir(at.join("others")).expect("there").count(), 1);
}

#[test]
fn a_doctor_names_everything_it_looks_at() {
    let dir = tempfile::tempdir().expect("a directory");
    let said: Value = serde_json::from_slice(&hilt(dir.path(), &["doctor", "--json"]).stdout).expect("JSON");
    let what: Vec<&str> = said.as_array().expect("a list").iter().filter_map(|f| f["what"].as_str()).collect();
    assert_eq!(
        what,
        ["cores", "kernel", "memory", "runs", "disk", "terminal", "settings", "make", "cargo", "python", "browser", "rerun"]
    );
    assert!(!dir.path().join("runs").exists(), "it only looks");
    fs::write(dir.path().join("file"), "").expect("written");
    refused(dir.path(), &["doctor", "--dir", "file/below"], 1, &["bad for hilt here"]);
}

#[test]
fn colours_are_there_where_they_are_wanted_and_nowhere_else() {
    let dir = tempfile::tempdir().expect("a directory");
    let said = |variables: &[(&str, &str)]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_hilt"));
        command.args(["render", "missing.mcap", "--gif"]).current_dir(dir.path());
        for name in ["NO_COLOR", "CLICOLOR", "CLICOLOR_FORCE"] {
            command.env_remove(name);
        }
        let output = command.envs(variables.iter().copied()).output().expect("the binary runs");
        String::from_utf8(output.stderr).expect("UTF-8")
    };
    let plain = said(&[]);
    assert!(plain.starts_with("error: ") && !plain.contains('\x1b'), "{plain:?}");
    assert!(said(&[("CLICOLOR_FORCE", "1")]).starts_with("\x1b["));
    assert_eq!(said(&[("NO_COLOR", "1")]), plain);
    assert_eq!(said(&[("TERM", "dumb")]), plain);
}

#[test]
fn the_version_says_of_which_commit_and_which_kernel() {
    let said = ok(Path::new("."), &["--version"]);
    let starts = ["hilt ", "commit: ", "kernel: "];
    assert!(said.lines().zip(starts).all(|(line, start)| line.starts_with(start)) && said.lines().count() == 3, "{said}");
}
