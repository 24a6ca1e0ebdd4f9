//! Tasks from files: what is read, what is refused, and a task that nobody ships through every stage.

use assert_cmd::Command;
use hilt::config::{Pipeline, SceneSettings, Source};
use hilt::data::{dataset, recording};
use hilt::math::hypot;
use hilt::robot::file::built_in::paper_robot;
use hilt::seed::stream;
use hilt::task::Target;
use hilt::tasks::draw_scene;
use std::fs;
use std::path::Path;

const COFFEE: &str = "fixtures/tasks/coffee.toml";

/// What is replaced by what.
type Replaced<'a> = &'a [(&'a str, &'a str)];

fn load(path: &Path) -> Result<Pipeline, String> {
    Pipeline::load(&Source::File(path.to_path_buf(), None), &[]).map_err(|why| why.to_string())
}

/// The fixture with parts replaced.
fn spoilt(replaced: Replaced) -> Result<Pipeline, String> {
    let text = replaced.iter().fold(fs::read_to_string(COFFEE).expect("the fixture"), |text, (from, to)| {
        assert!(text.contains(from), "the fixture has no {from}");
        text.replacen(from, to, 1)
    });
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("coffee.toml");
    fs::write(&path, text).expect("a file");
    load(&path)
}

fn hilt(words: &[&str]) -> Command {
    let mut command = Command::cargo_bin("hilt").expect("the binary");
    command.args(words);
    command
}

#[test]
fn a_task_of_ones_own_says_what_states_hold() {
    let task = load(Path::new(COFFEE)).expect("a task").task;
    let layout = task.layout(&paper_robot());
    let names: Vec<&str> = layout.state.iter().map(|span| span.name.as_str()).collect();
    assert_eq!(names, ["q", "dq", "cup", "sugar", "saucer", "goal"]);
    layout.check().expect("a layout");
    assert_eq!((layout.state_dim(), layout.changing()), (18 + 7 * 3 + 3, 18 + 7 * 2));
    let aims: Vec<(&str, &str)> = layout.aims.iter().map(|aim| (aim.object.as_str(), aim.target.as_str())).collect();
    assert_eq!(aims, [("cup", "saucer"), ("sugar", "goal")]);
    assert!((layout.aims[0].offset_m[2] - 0.04).abs() < 1e-12 && layout.aims[1].offset_m == [0.0; 3], "{:?}", layout.aims);
    assert!(matches!(task.goals[1].target, Target::At { tolerance_m: 0.03, .. }));
}

#[test]
fn scenes_are_drawn_from_the_places_of_the_file_with_room_between() {
    let task = &load(Path::new(COFFEE)).expect("a task").task;
    for index in 0..100 {
        let rng = &mut stream(3, "tasks test", index);
        let scene = draw_scene(&paper_robot(), task, &SceneSettings::default(), rng).expect("there is room");
        let [cup, sugar, saucer] = [0, 1, 2].map(|i| scene.objects[i].pose.position_m);
        assert!((0.34..=0.46).contains(&cup[0]) && (-0.12..=-0.06).contains(&cup[1]) && cup[2] == 0.03, "{cup:?}");
        assert!((0.08..=0.14).contains(&sugar[1]) && saucer == [0.54, -0.02, 0.01], "{sugar:?} {saucer:?}");
        assert_eq!([0, 1, 2].map(|i| scene.objects[i].mass_kg), [0.15, 0.1, 0.5]);
        let apart = |a: [f64; 3], b: [f64; 3]| hypot(a[0] - b[0], a[1] - b[1]);
        assert!(apart(cup, sugar) >= 0.095 && apart(cup, saucer) >= 0.12 && apart(sugar, scene.goals[0]) >= 0.10);
    }
}

#[test]
fn a_pipeline_file_without_a_sound_task_is_refused_by_its_key() {
    let cases: [(Replaced, &[&str]); 9] = [
        (&[("on = \"saucer\"", "on = \"sauce\"")], &["task", "unknown object \"sauce\"; did you mean saucer?"]),
        (&[("name = \"sugar\"", "name = \"cup\"")], &["two objects are called \"cup\""]),
        (&[("place = \"sugar\"", "move = \"sugar\"")], &["unknown field `move`", "`place`"]),
        (&[("cylinder_m = [0.025, 0.06]", "cylinder_m = [0.025]")], &["task", "array of length 2"]),
        (&[("[task]\nname = \"coffee\"", "[task]")], &["missing field `name`"]),
        (&[("name = \"coffee\"", "name = \"my coffee\"")], &["\"my coffee\"", "lower-case letters"]),
        (&[("tolerance_m = 0.03", "tolerance_m = 3.0")], &["tolerance_m = 3; allowed: 0.001 to 0.5"]),
        (&[("episodes = 30", "episode = 30")], &["unknown key plan.episode; did you mean plan.episodes?"]),
        (&[("mass_kg = 0.15", "mass_kg = \"heavy\"")], &["expected a number, or a range"]),
    ];
    for (replaced, expected) in cases {
        let why = spoilt(replaced).expect_err("refused");
        assert!(expected.iter().all(|part| why.contains(part)), "{expected:?} is not all in: {why}");
    }
}

#[test]
fn places_without_room_are_named() {
    let refused = |replaced: Replaced| {
        let task = spoilt(replaced).expect("a task").task;
        let drawn = draw_scene(&paper_robot(), &task, &SceneSettings::default(), &mut stream(3, "tasks test", 0));
        drawn.expect_err("no room").to_string()
    };
    // Two objects in one place; one out of reach; a goal that is.
    let why = refused(&[("x_m = [0.34, 0.46]\ny_m = [0.08, 0.14]", "x_m = 0.54\ny_m = 0.02")]);
    assert!(
        why.contains("\"sugar\" at x 0.54 m, y 0.02 m") && why.contains("0.05 m apart") && why.contains("x_m, y_m of"),
        "{why}"
    );
    let why = refused(&[("x_m = [0.34, 0.46]\ny_m = [-0.12, -0.06]", "x_m = [1.2, 1.4]\ny_m = 0.0")]);
    assert!(why.contains("\"cup\" at x [1.2, 1.4] m") && why.contains("0.295 to 0.68 m around the foot"), "{why}");
    let why = refused(&[("x_m = 0.50\ny_m = [0.14, 0.18]", "x_m = -1.5\ny_m = 0.0")]);
    assert!(why.contains("\"goal\" at x -1.5 m"), "{why}");
}

/// Robot and task from files outside of the library, with no compilation: planned, executed in contact physics, recorded, converted, learned
/// from, evaluated; and what another task of the same name made is refused.
#[test]
fn a_task_of_ones_own_goes_through_every_stage_on_a_robot_of_ones_own() {
    let dir = tempfile::tempdir().expect("a directory");
    let at = |name: &str| dir.path().join(name).to_str().expect("plain").to_string();
    fs::copy(COFFEE, at("coffee.toml")).expect("copied");
    let five = fs::canonicalize("fixtures/robots/five.toml").expect("the fixture");
    let task = at("coffee.toml");
    let own = ["--task", &task, "--robot", five.to_str().expect("plain"), "--quiet"];
    let run = |words: &[&str]| hilt(&[words, &own[..]].concat()).assert().success();
    run(&["plan", "--episodes", "4", "--out", &at("plans.parquet")]);
    run(&["simulate", "--plans", &at("plans.parquet"), "--out", &at("recordings"), "--set", "simulate.pulses.probability=0"]);
    for index in 0..4 {
        let (episode, _) =
            recording::read(&dir.path().join("recordings").join(recording::file_name(index))).expect("a recording");
        assert!(episode.success, "{index}: {:?}", episode.failure);
        let names: Vec<&str> = episode.scene.task.objects.iter().map(|object| object.name.as_str()).collect();
        assert_eq!((names, episode.last.objects.len()), (vec!["cup", "sugar", "saucer"], 3));
        // The cup stands on the saucer and nowhere else.
        let [cup, _, saucer] = &episode.last.contacts.objects[..] else { panic!("three objects") };
        assert!(cup.objects.contains(&2) && !cup.table && saucer.table && saucer.objects.contains(&0));
    }
    run(&["convert", "--recordings", &at("recordings"), "--out", &at("dataset")]);
    let found = dataset::read(&dir.path().join("dataset/train")).expect("a dataset");
    assert_eq!((found.task.as_str(), found.layout.name.as_str()), ("coffee", "coffee"));
    let said = hilt(&["inspect", &at("dataset"), "--json"]).output().expect("it runs").stdout;
    assert!(String::from_utf8_lossy(&said).contains("\"instruction\": \"Pick up the cup"), "what the file of the task says");
    let few = ["pretrain.epochs=1", "train.warm_start_updates=20", "train.epochs=1", "train.min_updates=0"];
    let few: Vec<&str> = few.iter().flat_map(|set| ["--set", set]).collect();
    let dynamics = at("dynamics.safetensors");
    run(&[&["pretrain", "--dataset", &at("dataset"), "--out", &dynamics][..], &few].concat());
    let policy = at("policy.safetensors");
    run(&[&["train", "--dataset", &at("dataset"), "--dynamics", &dynamics, "--out", &policy][..], &few].concat());
    run(&["evaluate", "--episodes", "2", "--policy", &policy, "--out", &at("evaluation.json")]);
    run(&["evaluate", "--episodes", "2", "--policy", "planner", "--record", &at("rollouts")]);
    hilt(&["render", &at("rollouts/episode-00000.mcap"), "--png", "--out", &at("coffee.png")]).assert().success();
    hilt(&["inspect", &at("recordings/episode-00000.mcap")]).assert().success();

    let text = fs::read_to_string(&task).expect("a file").replace("tolerance_m = 0.03", "tolerance_m = 0.04");
    fs::write(&task, text).expect("a file");
    for words in [["convert", "--recordings", &at("recordings")], ["evaluate", "--policy", &policy]] {
        let output = hilt(&[&words[..], &own[..]].concat()).output().expect("it runs");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && said.contains("its file has changed since; make it anew"), "{words:?}: {said}");
    }
}

/// `docs/add-a-task.md`, followed.
#[test]
fn the_page_is_read_as_it_stands_and_its_commands_run() {
    let page = fs::read_to_string("docs/add-a-task.md").expect("the page");
    let block =
        |kind: &str| page.split(&format!("```{kind}\n")).nth(1).and_then(|rest| rest.split("```").next()).expect("a block");
    let dir = tempfile::tempdir().expect("a directory");
    fs::write(dir.path().join("coffee.toml"), block("toml")).expect("a file");
    let pipeline = load(&dir.path().join("coffee.toml")).expect("the page's task");
    assert_eq!((pipeline.task.objects.len(), pipeline.task.goals.len(), pipeline.plan.episodes), (4, 2, 360));
    for key in [
        "name",
        "instruction",
        "box_m",
        "cylinder_m",
        "bin_m",
        "at",
        "x_m",
        "y_m",
        "yaw_rad",
        "friction",
        "mass_kg",
        "grip_m",
        "lift",
        "height_m",
        "place",
        "tolerance_m",
        "on",
        "in",
    ] {
        assert!(page.contains(&format!("{key} =")) || page.contains(&format!("`{key}`")), "{key} is not on the page");
    }
    let bin = Path::new(env!("CARGO_BIN_EXE_hilt")).parent().expect("a directory").display().to_string();
    let path = format!("{bin}:{}", std::env::var("PATH").expect("set"));
    // Make builds and trains; tests/make runs it with a task from a file.
    let commands: String =
        block("sh").lines().filter(|line| !line.starts_with("make ")).map(|line| format!("{line}\n")).collect();
    let ended = std::process::Command::new("bash").args(["-euc", &commands]).env("PATH", path).current_dir(dir.path()).output();
    let ended = ended.expect("bash");
    let said = String::from_utf8_lossy(&ended.stdout);
    assert!(
        ended.status.success() && said.contains("coffee: success 20 of 20"),
        "{said}{}",
        String::from_utf8_lossy(&ended.stderr)
    );
}
