//! The command line from outside: exit codes, words of errors, helps.

use assert_cmd::Command;
use std::fs;

const STAGES: [&str; 20] = [
    "plan",
    "simulate",
    "convert",
    "pretrain",
    "train",
    "evaluate",
    "inspect",
    "runs",
    "compare",
    "plot",
    "view",
    "render",
    "replay",
    "settings",
    "export",
    "serve",
    "serve-env",
    "doctor",
    "completions",
    "man",
];

fn hilt(words: &[&str]) -> Command {
    let mut command = Command::cargo_bin("hilt").expect("the binary is built with the tests");
    command.args(words);
    command
}

/// Runs, expects the exit code, and returns stderr; nothing may have been printed to stdout.
fn refused(words: &[&str], code: i32) -> String {
    let output = hilt(words).output().expect("the binary runs");
    let stderr = String::from_utf8(output.stderr).expect("words are UTF-8");
    assert_eq!(output.status.code(), Some(code), "{words:?}: {stderr}");
    assert!(output.stdout.is_empty(), "{words:?} printed to stdout");
    assert_eq!(stderr.matches("error: ").count(), 1, "one error, printed once: {stderr}");
    stderr
}

fn says(words: &[&str], code: i32, parts: &[&str]) {
    let stderr = refused(words, code);
    for part in parts {
        assert!(stderr.contains(part), "{words:?} should say \"{part}\": {stderr}");
    }
}

fn settings_of(words: &[&str]) -> String {
    let output = hilt(&[&["settings"], words].concat()).output().expect("the binary runs");
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("TOML is UTF-8")
}

#[test]
fn every_stage_has_a_help() {
    let all = String::from_utf8(hilt(&["--help"]).output().expect("runs").stdout).expect("UTF-8");
    for stage in STAGES {
        assert!(all.contains(&format!("\n  {stage} ")), "{stage} is missing from the list: {all}");
        let output = hilt(&[stage, "--help"]).output().expect("runs");
        let help = String::from_utf8(output.stdout).expect("UTF-8");
        assert_eq!(output.status.code(), Some(0));
        assert!(help.contains("Usage: hilt") && help.contains(stage), "{help}");
    }
    assert!(all.contains("130 interrupted"));
}

#[test]
fn wrong_usage_ends_with_two() {
    says(&["plan"], 2, &["--task", "pick-up, pick-and-place, stack"]);
    says(&["plan", "--task", "juggle"], 2, &["unknown task \"juggle\"", "pick-up, pick-and-place, stack"]);
    says(&["fly"], 2, &["unrecognized subcommand 'fly'"]);
    says(&["plan", "--task", "stack", "--preset", "worst"], 2, &["unknown preset \"worst\"", "best, mended, paper"]);
    says(&["plan", "--task", "stack", "--threads", "0"], 2, &["--threads"]);
    says(&["train", "--task", "stack", "--method", "magic"], 2, &["magic", "hil"]);
    says(&["render", "a.mcap"], 2, &["--gif", "--png"]);
}

#[test]
fn an_unknown_key_is_refused_with_the_nearest() {
    says(&["settings", "--task", "stack", "--set", "plan.sped=1"], 2, &["unknown key plan.sped", "did you mean plan.speed?"]);
    says(&["settings", "--task", "stack", "--set", "trane.rho=0.5"], 2, &["unknown key trane.rho", "train.rho"]);
    says(&["settings", "--task", "stack", "--set", "speed=1"], 2, &["stage.key", "plan.speed"]);
    says(&["settings", "--task", "stack", "--set", "plan.speed"], 2, &["stage.key=value"]);
    says(&["settings", "--task", "stack", "--set", "plan.speed.x=1"], 2, &["plan.speed"]);

    let dir = tempfile::tempdir().expect("temporary directory");
    let file = dir.path().join("mine.toml");
    let name = file.to_str().expect("UTF-8 path");
    for (text, parts) in [
        ("task = \"stack\"\n[evaluat]\nepisodes = 3\n", ["mine.toml", "unknown key evaluat.episodes", "evaluate.episodes"]),
        (
            "task = \"stack\"\n[[scene.obstacles]]\ncentre_m = [0.0, 0.0, 0.1]\nsize_m = [0.1, 0.1, 0.1]\n",
            ["mine.toml", "unknown key scene.obstacles.centre_m", "scene.obstacles.center_m"],
        ),
        ("task = \"stack\"\n[plan\n", ["mine.toml", "not valid TOML", "line 2"]),
        ("[plan]\nspeed = 0.5\n", ["mine.toml", "names no task", "--task"]),
    ] {
        fs::write(&file, text).expect("written");
        says(&["settings", "--pipeline", name], 2, &parts);
    }
}

#[test]
fn a_wrong_value_is_refused_with_what_is_allowed() {
    let set = |words: &str, parts: &[&str]| says(&["settings", "--task", "pick-up", "--set", words], 2, parts);
    set("plan.episodes=many", &["plan.episodes", "many", "1 to 100000"]);
    set("plan.episodes=2.5", &["plan.episodes", "2.5", "1 to 100000"]);
    set("plan.episodes=-1", &["plan.episodes", "-1", "1 to 100000"]);
    set("plan.episodes=0", &["plan.episodes", "0", "1 to 100000"]);
    set("plan.speed=nan", &["plan.speed", "nan", "above 0 up to 1"]);
    set("plan.speed=0", &["plan.speed", "above 0 up to 1"]);
    set("simulate.pulses.probability=1.5", &["simulate.pulses.probability", "1.5", "0 to 1"]);
    set("scene.yaw=1", &["scene.yaw", "boolean"]);
    set("scene.spawn_x_m=[0.5, 0.3]", &["scene.spawn_x_m", "lower end first"]);
    set("scene.spawn_x_m=[0.5]", &["scene.spawn_x_m"]);
    set("scene.friction=[1.2, 0.4]", &["scene.friction", "lower end first"]);
    set("scene.friction=rough", &["scene.friction", "rough", "a number, or a range", "0 to 10"]);
    set("scene.block_mass_kg=[0.0, 0.3]", &["scene.block_mass_kg", "above 0 up to 10"]);
    set("scene.base_xy_m=[[0.5, 0.4], 0.3]", &["scene.base_xy_m", "lower end first"]);
    set("scene.obstacles=[{center_m=[0.0,0.0,0.0],size_m=[0.1,0.1,0.0]}]", &["scene.obstacles.size_m", "above 0 up to 4"]);
}

#[test]
fn rho_and_alpha_out_of_range_are_refused() {
    says(&["train", "--task", "stack", "--rho", "1.2"], 2, &["train.rho", "1.2"]);
    says(&["train", "--task", "stack", "--rho", "high"], 2, &["--rho"]);
    says(&["train", "--task", "stack", "--alpha", "-0.1"], 2, &["alpha"]);
    says(&["train", "--task", "stack", "--set", "train.alpha=often"], 2, &["train.alpha", "often", "adaptive"]);
    says(&["evaluate", "--task", "stack", "--policy", "planner", "--episodes", "0"], 2, &["evaluate.episodes", "1 to 100000"]);
}

#[test]
fn missing_and_foreign_files_end_with_one_and_leave_nothing() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let at = |name: &str| dir.path().join(name).to_str().expect("UTF-8 path").to_string();
    fs::write(at("noise"), b"neither Parquet nor MCAP nor safetensors").expect("written");
    let (missing, noise, out) = (at("missing"), at("noise"), at("out"));
    for file in [&missing, &noise] {
        says(&["simulate", "--task", "pick-up", "--plans", file, "--out", &out], 1, &[file]);
        says(&["convert", "--task", "pick-up", "--recordings", file, "--out", &out], 1, &[file]);
        says(&["pretrain", "--task", "pick-up", "--dataset", file, "--out", &at("out.safetensors")], 1, &[file]);
        says(&["train", "--task", "pick-up", "--dataset", file, "--out", &at("out.safetensors")], 1, &[file]);
        says(&["evaluate", "--task", "pick-up", "--policy", file, "--out", &at("out.json")], 1, &[file]);
        says(&["inspect", file], 1, &[file]);
        says(&["render", file, "--png", "--out", &at("out.png")], 1, &[file]);
    }
    says(&["settings", "--pipeline", &missing], 1, &[&missing, "cannot read"]);
    assert_eq!(fs::read_dir(dir.path()).expect("readable").count(), 1, "something was left behind");
}

#[test]
fn settings_come_in_the_promised_order() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let file = dir.path().join("mine.toml");
    fs::write(&file, "task = \"stack\"\n[plan]\nepisodes = 11\nspeed = 0.5\n").expect("written");
    let name = file.to_str().expect("UTF-8 path");
    let text = settings_of(&["--pipeline", name, "--set", "plan.episodes=12", "--seed", "5"]);
    for line in ["# seed 5", "task = \"stack\"", "episodes = 12", "speed = 0.5", "max_steps = "] {
        assert!(text.contains(line), "\"{line}\" is missing: {text}");
    }
    // What is printed is itself a pipeline file that resolves to the same.
    fs::write(&file, &text).expect("written");
    assert_eq!(settings_of(&["--pipeline", name, "--seed", "5"]), text);
    says(&["settings", "--pipeline", name, "--task", "pick-up"], 2, &["is for task stack", "--task pick-up"]);
}

#[test]
fn all_presets_of_all_tasks_resolve_and_a_stage_shows_its_own_sections() {
    for task in ["pick-up", "pick-and-place", "stack"] {
        let paper = settings_of(&["--task", task, "--preset", "paper"]);
        assert!(paper.contains("probability = 0.0"), "the paper has no pulses: {paper}");
        assert_ne!(settings_of(&["--task", task]), paper);
        let mended = settings_of(&["--task", task, "--preset", "mended"]);
        assert_ne!(mended, paper);
        let same = paper.lines().filter(|line| mended.contains(line)).count();
        assert!(10 * same > 8 * paper.lines().count(), "mended is the paper's preset with few keys changed: {mended}");
        let file = format!("{}/pipelines/{task}.toml", env!("CARGO_MANIFEST_DIR"));
        assert_eq!(settings_of(&["--pipeline", &file]), settings_of(&["--task", task]), "the binary carries another {task}.toml");
    }
    let train = settings_of(&["--task", "stack", "--stage", "train"]);
    assert!(train.contains("[train]") && !train.contains("[plan]") && !train.contains("[evaluate]"), "{train}");
    // A change in one stage leaves the others' settings as they are.
    let other = settings_of(&["--task", "stack", "--set", "train.rho=0.25", "--stage", "pretrain"]);
    assert_eq!(other, settings_of(&["--task", "stack", "--stage", "pretrain"]));
}

#[test]
fn a_file_that_extends_a_preset_changes_only_its_own_keys() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let file = dir.path().join("mine.toml");
    let name = file.to_str().expect("UTF-8 path");
    fs::write(&file, "extends = \"paper\"\n[train.sc]\nknee = 0.25\n").expect("written");
    let mine = settings_of(&["--pipeline", name, "--task", "stack"]);
    let set = settings_of(&["--task", "stack", "--preset", "paper", "--set", "train.sc.knee=0.25"]);
    assert_eq!(mine, set);
    says(&["settings", "--pipeline", name], 2, &["names no task"]);
    fs::write(&file, "extends = \"papre\"\ntask = \"stack\"\n").expect("written");
    says(&["settings", "--pipeline", name], 2, &[name, "extends: unknown preset \"papre\"; did you mean paper?"]);
    fs::write(&file, "extends = 1\ntask = \"stack\"\n").expect("written");
    says(&["settings", "--pipeline", name], 2, &["extends: 1 is no preset's name in quotes"]);
}

#[test]
fn a_reader_that_stops_early_is_no_error() {
    let bin = assert_cmd::cargo::cargo_bin!("hilt");
    let script = format!("set -o pipefail; {} settings --task stack | true", bin.display());
    let output = std::process::Command::new("bash").args(["-c", &script]).output().expect("bash runs");
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(output.stderr.is_empty());
}

#[test]
fn a_name_is_offered_when_it_is_near_whatever_its_case_and_none_when_nothing_is() {
    let set = |words: &str, parts: &[&str]| says(&["settings", "--task", "stack", "--set", words], 2, parts);
    set("PLAN.SPEED=0.5", &["unknown key PLAN.SPEED; did you mean plan.speed?"]);
    set("Train.Rho=0.5", &["did you mean train.rho?"]);
    set("pretrain.activation=tan", &["did you mean tanh?"]);
    set("train.features=FK", &["did you mean fk?"]);
    set("train.sc.fingers=folowing", &["did you mean following?"]);
    let far = refused(&["settings", "--task", "stack", "--set", "xyzzy.foo=1"], 2);
    assert!(!far.contains("did you mean"), "{far}");
    says(&["plan", "--task", "stak"], 2, &["unknown task \"stak\"; did you mean stack? allowed: pick-up, pick-and-place, stack"]);
    says(&["plan", "--task", "pickup"], 2, &["did you mean pick-up?"]);
    says(&["plan", "--task", "stack", "--preset", "bset"], 2, &["did you mean best?"]);
    says(&["settings", "--task", "stack", "--stage", "trian"], 2, &["did you mean train?"]);
    says(&["train", "--task", "stack", "--method", "HIL"], 2, &["did you mean hil?"]);
}

#[test]
fn a_number_beyond_64_bits_is_said_with_what_is_allowed() {
    let huge = "18446744073709551615";
    says(&["plan", "--task", "stack", "--episodes", huge], 2, &["--episodes", huge, "plan.episodes", "allowed: 1 to 100000"]);
    let set = |words: &str, parts: &[&str]| says(&["settings", "--task", "stack", "--set", words], 2, parts);
    set("pretrain.epochs=99999999999999999999999999", &["out of range; allowed: 1 to 1000000"]);
    set("train.batch=-99999999999999999999999999", &["out of range; allowed: 1 to 100000"]);
    set("plan.speed=1e999", &["1e999: out of range; allowed: above 0 up to 1"]);
    set("scene.obstacles=[{center_m=[0,0,.3],size_m=[1,1,1]}]", &["scene.obstacles", "not valid TOML", "expected digits"]);
}

/// A key of 60,000 parts overflowed the stack; a long one took 18 s.
#[test]
fn keys_values_and_files_beyond_their_limits_are_refused_at_once() {
    let started = std::time::Instant::now();
    let set = |words: &str, parts: &[&str]| {
        let stderr = refused(&["settings", "--task", "stack", "--set", words], 2);
        assert!(parts.iter().all(|part| stderr.contains(part)) && stderr.len() < 2000, "{stderr}");
    };
    set(&format!("{}=1", ["a"; 60_000].join(".")), &["a key of 60000 parts; none has more than 4"]);
    set(&format!("plan.speed={}", "[".repeat(60_000)), &["not valid TOML", "recursion"]);
    set(&format!("plan.speed={}{}", "[".repeat(60_000), "]".repeat(60_000)), &["not valid TOML", "recursion"]);
    set(&format!("{}.b=1", "a".repeat(120_000)), &["unknown key aaa", "(120002 characters)"]);
    set(&format!("plan.speed={}", "fast".repeat(30_000)), &["plan.speed", "(120002 characters)", "above 0 up to 1"]);

    let dir = tempfile::tempdir().expect("temporary directory");
    let file = dir.path().join("mine.toml");
    let name = file.to_str().expect("UTF-8 path");
    let boxes = "[[scene.obstacles]]\ncenter_m = [1.5, 1.5, 0.1]\nsize_m = [0.1, 0.1, 0.1]\n".repeat(101);
    for (text, part) in [
        (format!("{} = 1\n", ["a"; 60_000].join(".")), "recursion limit"),
        (format!("[{}]\nb = 1\n", ["a"; 60_000].join(".")), "recursion limit"),
        (format!("x = {}{}\n", "[".repeat(60_000), "]".repeat(60_000)), "recurs"),
        (format!("{} = 1\n", "a".repeat(900_000)), "(900000 characters)"),
        ("# words\n".repeat(200_000), "longer than 1048576 bytes"),
        (boxes, "101 boxes; allowed: up to 100"),
    ] {
        fs::write(&file, format!("task = \"stack\"\n{text}")).expect("written");
        let stderr = refused(&["settings", "--pipeline", name], 2);
        assert!(stderr.contains(part) && stderr.len() < 2000, "{part}: {stderr}");
    }
    says(&["settings", "--pipeline", "/dev/zero"], 2, &["/dev/zero", "longer than 1048576 bytes"]);
    assert!(started.elapsed().as_secs() < 10, "took {:?}", started.elapsed());
}

#[test]
fn what_breaks_the_simulation_down_or_takes_all_memory_is_refused_with_the_reason() {
    let set = |words: &str, parts: &[&str]| says(&["settings", "--task", "pick-up", "--set", words], 2, parts);
    set(
        "scene.obstacles=[{center_m=[0.0,0.0,0.3],size_m=[0.02,0.02,0.02]}]",
        &["scene.obstacles[0]", "arm where every episode begins"],
    );
    set("scene.block_mass_kg=1e-21", &["scene.block_mass_kg", "no less than 0.001", "single precision"]);
    set("scene.block_mass_kg=[1e-21, 0.1]", &["no less than 0.001"]);
    set("pretrain.hidden_units=4096", &["pretrain.hidden_units = 4096", "5000000 are the most"]);
    set("train.hidden_units=4096", &["train.hidden_units = 4096", "5000000 are the most"]);
    set("train.select_candidates=9000000000000000000", &["train.select_candidates", "1 to 1000000"]);
    set("train.min_updates=9000000000000000000", &["train.min_updates", "0 to 10000000"]);
    set("train.batch=9000000000000000000", &["train.batch", "1 to 100000"]);
}
