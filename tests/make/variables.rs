//! Variables of make: taken to the letter, or refused in one sentence that names them, before anything is done.

use crate::{ALL, Run, TINY, command, stages, text, tree};
use std::fs;

#[test]
fn what_make_cannot_take_is_refused_by_name_and_nothing_is_done() {
    let tree = tree();
    let names = || {
        let mut names: Vec<_> = fs::read_dir(tree.path()).expect("readable").map(|e| e.expect("entry").file_name()).collect();
        names.sort();
        names
    };
    let before = names();
    let runs = [
        "",
        " ",
        "my runs",
        "a:b",
        "a%b",
        "a(b",
        "a$b",
        "a$(shell touch oops)b",
        "a#b",
        "-a",
        "a'b",
        "a\"b",
        "a\\b",
        "a;touch oops",
        "a*",
        "~/a",
        "a\nb",
        "a=b",
    ];
    let mut cases: Vec<(&str, &str)> = runs.into_iter().map(|value| ("RUNS", value)).collect();
    cases.extend(["", "stack pick-up", "stakc", "%", "$(TASKS)"].map(|value| ("TASK", value)));
    cases.extend(["", "dagger", "hil bc"].map(|value| ("METHOD", value)));
    cases.extend(["", "-1", "abc", "1 2", "1.5", "$(shell touch oops)"].map(|value| ("SEED", value)));
    cases.extend(["", "two"].map(|value| ("THREADS", value)));
    cases.extend(["a b.toml", "-x.toml", "x/$(shell touch oops).toml"].map(|value| ("ROBOT", value)));
    cases.extend(["a b.toml", "-x.toml", "x/$(shell touch oops).toml"].map(|value| ("TASK", value)));
    cases.extend([("PRESET", "better"), ("PIPELINE", ""), ("RESUME", "yes"), ("CHECKPOINT", "often")]);
    for (name, value) in cases {
        for goal in ["all", "clean-runs"] {
            let output = command(tree.path(), &[goal, &format!("{name}={value}")]).output().expect("make runs");
            let stderr = text(&output.stderr);
            assert_eq!(output.status.code(), Some(2), "{name}=\"{value}\": {stderr}");
            assert!(stderr.contains(&format!("*** {name} is ")), "{name}=\"{value}\": {stderr}");
            assert!(output.stdout.is_empty() && names() == before, "{name}=\"{value}\" did something");
        }
    }
}

#[test]
fn overrides_with_blanks_brackets_and_quotes_arrive_whole() {
    let tree = tree();
    let settings = |set: &str| {
        let output = command(tree.path(), &["runs/pick-up/plans.parquet", &format!("SET={set}")]).output().expect("make runs");
        assert!(output.status.success(), "{set}: {}", text(&output.stderr));
        fs::read_to_string(tree.path().join("runs/pick-up/settings/plan.toml")).expect("settings")
    };
    let wall = "scene.obstacles=[{center_m=[0.4, 0, 0.8], size_m=[0.1,0.1,0.1]}]";
    let stated = settings(&format!("plan.episodes=1 {wall}\n  train.alpha=\"adaptive\" plan.speed=0.7"));
    for part in ["episodes = 1", "speed = 0.7", "center_m = [0.4, 0.0, 0.8]", "size_m = [0.1, 0.1, 0.1]"] {
        assert!(stated.contains(part), "\"{part}\" is not in {stated}");
    }
    assert!(settings("plan.episodes=1 train.alpha='adaptive'").contains("episodes = 1"));
}

#[test]
fn an_override_that_cannot_be_is_refused_to_the_letter() {
    let run = Run::finished();
    let before = run.contents();
    // Up to a blank, unless it is inside brackets.
    let words = |set: &'static str| if set.contains('[') { set } else { set.split(' ').next().expect("a word") };
    for set in [
        "plan.speed=a'b\"c",
        "plan.speed=$(shell touch oops)",
        "plan.speed=$HOME",
        "plan.speed=`touch oops`",
        "plan.speed=1;touch",
        "plan.speed=#",
        "plan.speed=[1 train.rho=2",
        "plan.speed=a\\b",
    ] {
        let output = run.make(&[&format!("SET={TINY} {set}")]);
        let stderr = text(&output.stderr);
        assert!(!output.status.success() && stderr.contains(&format!("--set {}", words(set))), "{set}: {stderr}");
    }
    assert!(run.contents() == before && !run.tree.path().join("oops").exists());
    assert!(run.all(&[]).is_empty());
}

#[test]
fn names_that_make_can_take_work() {
    let run = Run::finished();
    fs::rename(run.tree.path().join("runs"), run.tree.path().join("läufe,2@x+y")).expect("renamed");
    fs::create_dir(run.tree.path().join("my pipelines")).expect("made");
    fs::copy(run.tree.path().join("pipelines/pick-up.toml"), run.tree.path().join("my pipelines/it's mine.toml"))
        .expect("copied");
    for words in [&["RUNS=läufe,2@x+y"][..], &["RUNS=./läufe,2@x+y/", "TASK= pick-up ", "PIPELINE=my pipelines/it's mine.toml"]]
    {
        assert!(run.all(words).is_empty(), "{words:?}");
    }
}

/// Another robot has runs of its own, and what its files say belongs to the settings.
#[test]
fn a_robot_from_a_file_is_planned_for_and_a_changed_one_is_noticed() {
    let tree = tree();
    let robots = tree.path().join("mine");
    fs::create_dir(&robots).expect("a directory");
    for file in ["five.toml", "five.urdf", "wrist.stl"] {
        let from = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/robots").join(file);
        fs::copy(from, robots.join(file)).expect("copied");
    }
    let plans = || {
        let goal = ["runs/five/pick-up/plans.parquet", "ROBOT=mine/five.toml", "SET=plan.episodes=2"];
        let output = command(tree.path(), &goal).output().expect("make runs");
        assert!(output.status.success(), "{}", text(&output.stderr));
        let settings = fs::read_to_string(tree.path().join("runs/five/pick-up/settings/plan.toml")).expect("settings");
        settings.lines().find(|line| line.starts_with("# robot five ")).expect("the robot's content").to_string()
    };
    let first = plans();
    assert!(tree.path().join("runs/five/pick-up/plans.parquet").is_file() && plans() == first);
    let file = robots.join("five.toml");
    let changed = fs::read_to_string(&file).expect("text").replace("speed = 0.1", "speed = 0.12");
    fs::write(&file, changed).expect("written");
    assert_ne!(plans(), first);
}

/// A task and a robot from files outside of the library, with no compilation, from demonstrations to an evaluated policy.
#[test]
fn a_task_from_a_file_is_learned_on_a_robot_from_a_file_and_a_changed_one_is_noticed() {
    let tree = tree();
    let mine = tree.path().join("mine");
    fs::create_dir(&mine).expect("a directory");
    for file in ["robots/five.toml", "robots/five.urdf", "robots/wrist.stl", "tasks/coffee.toml"] {
        let from = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(file);
        fs::copy(&from, mine.join(from.file_name().expect("a name"))).expect("copied");
    }
    let set = format!("SET={TINY} simulate.pulses.probability=0");
    let make = |words: &[&str]| {
        let own = ["TASK=mine/coffee.toml", "ROBOT=mine/five.toml", &set];
        let output = command(tree.path(), &[words, &own].concat()).output().expect("make runs");
        assert!(output.status.success(), "{}", text(&output.stderr));
        stages(&output)
    };
    assert_eq!(make(&["all"]), ALL);
    for file in ["plans.parquet", "dataset/train/meta/info.json", "policy.safetensors", "evaluation.json"] {
        assert!(tree.path().join("runs/five/coffee").join(file).is_file(), "{file}");
    }
    assert!(make(&["all"]).is_empty());
    let file = mine.join("coffee.toml");
    let changed = fs::read_to_string(&file).expect("text").replace("tolerance_m = 0.03", "tolerance_m = 0.04");
    fs::write(&file, changed).expect("written");
    assert_eq!(make(&["all"]), ALL);
    // The other presets have settings for any task.
    for preset in ["PRESET=mended", "PRESET=paper"] {
        assert!(make(&["runs/five/coffee/dynamics.safetensors", preset]).contains(&"pretrain".into()), "{preset}");
    }
}
