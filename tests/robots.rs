//! Robots from files: what is read, what is doubtful, what is refused.

use assert_cmd::Command;
use hilt::data::{dataset, recording};
use hilt::interrupt::Interrupt;
use hilt::joints::Joints;
use hilt::robot::Robot;
use hilt::robot::file;
use hilt::robot::file::description::Read;
use hilt::robot::model::{JointKind, Shape};
use std::fs;
use std::path::{Path, PathBuf};

const TOML: &str = include_str!("../fixtures/robots/five.toml");
const URDF: &str = include_str!("../fixtures/robots/five.urdf");

/// The fixture with parts of its files replaced.
fn spoilt(dir: &Path, toml: &[(&str, &str)], urdf: &[(&str, &str)]) -> PathBuf {
    let spoil = |text: &str, replaced: &[(&str, &str)]| {
        replaced.iter().fold(text.to_string(), |text, (from, to)| {
            assert!(text.contains(from), "the fixture has no {from}");
            text.replacen(from, to, 1)
        })
    };
    fs::write(dir.join("five.urdf"), spoil(URDF, urdf)).expect("a file");
    fs::write(dir.join("five.toml"), spoil(TOML, toml)).expect("a file");
    fs::copy("fixtures/robots/wrist.stl", dir.join("wrist.stl")).expect("a file");
    dir.join("five.toml")
}

fn refused(toml: &[(&str, &str)], urdf: &[(&str, &str)]) -> String {
    let dir = tempfile::tempdir().expect("a directory");
    file::read(&spoilt(dir.path(), toml, urdf)).expect_err("refused").to_string()
}

#[test]
fn a_robot_of_five_joints_is_read() {
    let Read { robot, remarks } = file::read(Path::new("fixtures/robots/five.toml")).expect("a robot");
    assert_eq!((robot.arm, robot.joints.len(), robot.links.len()), (5, 7, 8));
    let names: Vec<&str> = robot.joints.iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(names, ["turn", "shoulder", "elbow", "bend", "roll", "left", "right"]);
    assert!(robot.joints[0].continuous && robot.joints[5].kind == JointKind::Prismatic);
    assert_eq!((robot.joints[4].effort, robot.joints[6].motor.friction, robot.joints[6].parent), (12.0, 2.0, 5));

    // What is fixed is one link: wrist with its cover, palm with its camera; axes other than z change frames, not places.
    let wrist = &robot.links[4];
    assert!((wrist.inertia.mass_kg - 0.6).abs() < 1e-12 && (robot.links[5].inertia.mass_kg - 0.35).abs() < 1e-12);
    let tool = robot.tool_pose(&robot.ready);
    assert!((tool.translation.vector - nalgebra::Vector3::new(0.45, 0.0, 0.30)).norm() < 1e-4, "{tool}");
    assert!(tool.rotation.angle() < 1e-4, "{tool}");
    assert!(matches!(robot.links[2].shapes[..], [Shape::Capsule { radius_m: 0.03, .. }]), "{:?}", robot.links[2].shapes);
    let Shape::Box { half_m, .. } = wrist.shapes[0] else { panic!("a mesh becomes a box") };
    assert!(half_m.iter().zip([0.02, 0.02, 0.04]).all(|(a, b)| (a - b).abs() < 1e-6), "{half_m:?}");

    let said = remarks.join("\n");
    for part in ["a cylinder of link foot", "mesh of link cover", "finger right mimics left", "camera_tilt is held at 0.3"] {
        assert!(said.contains(part), "{part} is not in {said}");
    }
}

#[test]
fn the_jacobian_of_a_read_robot_equals_finite_differences() {
    let robot = file::read(Path::new("fixtures/robots/five.toml")).expect("a robot").robot;
    let q: Joints = robot.ready.iter().enumerate().map(|(i, v)| v + 0.1 * i as f64).collect();
    let (_, jacobian) = robot.tool_jacobian(&q);
    for i in 0..robot.arm {
        let moved = |by: f64| {
            let mut q = q;
            q[i] += by;
            robot.tool_pose(&q)
        };
        let (plus, minus) = (moved(1e-6), moved(-1e-6));
        let linear = (plus.translation.vector - minus.translation.vector) / 2e-6;
        let angular = (plus.rotation * minus.rotation.inverse()).scaled_axis() / 2e-6;
        assert!((linear - jacobian.fixed_view::<3, 1>(0, i)).norm() < 1e-7, "joint {i}");
        assert!((angular - jacobian.fixed_view::<3, 1>(3, i)).norm() < 1e-7, "joint {i}");
    }
}

#[test]
fn impossible_descriptions_are_refused_with_what_to_do() {
    type Spoiling = &'static [(&'static str, &'static str)];
    let cases: [(Spoiling, Spoiling, &str); 32] = [
        (&[("name = \"five\"", "name = \"\"")], &[], "name = \"\" is no name of a directory"),
        (&[("name = \"five\"", "name = \"../five\"")], &[], "is no name of a directory"),
        (&[("reach_m = [0.20, 0.62]", "reach_m = [0.7, 0.62]")], &[], "the nearer first"),
        (
            &[],
            &[("<inertial><origin xyz=\"0 0 0.1\"/>", "<nothing>"), ("ixz=\"0\" iyz=\"0\"/></inertial>", "/></nothing>")],
            "\"post\" moves, but has no mass",
        ),
        (&[], &[("<mass value=\"2\"/>", "")], "no <mass>"),
        (&[], &[("<mass value=\"2\"/>", "<mass value=\"two\"/>")], "line 12, <mass>: value is \"two\""),
        (&[], &[("ixx=\"0.01\" iyy=\"0.01\" izz=\"0.004\"", "ixx=\"-1\" iyy=\"0.01\" izz=\"0.004\"")], "each must be above 0"),
        (
            &[],
            &[("package://five_description/wrist.stl", "package://five_description/gone.stl")],
            "the mesh package://five_description/gone.stl is not there",
        ),
        (&[], &[("package://five_description/wrist.stl", "five.urdf")], "hilt reads meshes in STL"),
        (&[], &[("<child link=\"upper\"/>", "<child link=\"post\"/>")], "\"post\" hangs on two joints"),
        (&[], &[("<parent link=\"foot\"/>", "<parent link=\"palm\"/>")], "loop"),
        (
            &[],
            &[("<parent link=\"post\"/><child link=\"upper\"/>", "<parent link=\"poost\"/><child link=\"upper\"/>")],
            "there is no link \"poost\"; did you mean post",
        ),
        (&[("fingers = [\"left\", \"right\"]", "fingers = [\"left\"]")], &[], "an arm of 5 joints and 1 fingers"),
        (&[("camera_tilt = 0.3", "")], &[], "\"camera_tilt\" moves, but is neither under arm nor under fingers"),
        (&[("arm = [\"turn\", \"shoulder\"", "arm = [\"shoulder\", \"turn\"")], &[], "name them from the foot to the hand"),
        (&[("\"bend\", \"roll\"]", "\"bend\", \"rol\"]")], &[], "there is no joint \"rol\" in the URDF; did you mean roll"),
        (&[], &[("name=\"elbow\" type=\"revolute\"", "name=\"elbow\" type=\"planar\"")], "type \"planar\"; allowed: revolute"),
        (&[], &[("name=\"elbow\" type=\"revolute\"", "name=\"elbow\" type=\"floating\"")], "type \"floating\""),
        (&[], &[("name=\"elbow\" type=\"revolute\"", "name=\"elbow\" type=\"prismatic\"")], "joint \"elbow\" of the arm slides"),
        (
            &[],
            &[("velocity=\"2\" effort=\"40\"/>", "velocity=\"2\" effort=\"40\"/><mimic joint=\"bend\"/>")],
            "joint \"elbow\" of the arm mimics \"bend\"",
        ),
        (
            &[],
            &[("lower=\"-2\" upper=\"2\" velocity=\"1.5\"", "lower=\"-2\" upper=\"2\"")],
            "\"shoulder\" has no velocity in its <limit>",
        ),
        (&[], &[("lower=\"-2\" upper=\"2\"", "lower=\"2\" upper=\"-2\"")], "limits 2 to -2"),
        (&[], &[("lower=\"-2\" upper=\"2\"", "")], "joint \"shoulder\" has no limits"),
        (&[("0.44781", "2.5")], &[], "joint \"shoulder\" is at 2.5, its limits are -2 to 2"),
        (&[("opened = [0.045, 0.045]", "opened = [0.045]")], &[], "hand.opened has 1 positions, 2 are needed"),
        (&[("[fixed]", "[fixd]")], &[], "unknown field `fixd`"),
        (&[("xyz_m = [0.0, 0.0, 0.11]", "xyz_m = [0.0, nan, 0.11]")], &[], "tool.xyz_m.1 is NaN"),
        (
            &[(
                "[packages]",
                "[shapes]\nfoot = [{ capsule = { from_m = [0, 0, 0], to_m = [0, 0, 1], radius_m = -0.1 } }]\n\n[packages]",
            )],
            &[],
            "shapes.foot: a size of -0.1 m",
        ),
        (&[], &[("<axis xyz=\"0 0 1\"/>", "<axis xyz=\"0 0 0\"/>")], "its axis is no direction"),
        (&[], &[("<box size=\"0.08 0.08 0.16\"/>", "<box size=\"0.08 0.08\"/>")], "size has 2 numbers, 3 are needed"),
        (
            &[],
            &[("<robot name=\"five\">", "<!DOCTYPE robot [<!ENTITY a \"aaaa\">]><robot name=\"five\">")],
            "not a readable XML document",
        ),
        (
            &[],
            &[("<robot name=\"five\">", "<robot name=\"five\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\"><xacro:arm/>")],
            "expand the document first",
        ),
    ];
    for (toml, urdf, said) in cases {
        let why = refused(toml, urdf);
        assert!(why.contains(said) && why.contains("five."), "\"{said}\" is not in: {why}");
    }
}

#[test]
fn the_page_shows_every_key_and_is_read_as_it_stands() {
    let page = fs::read_to_string("docs/add-a-robot.md").expect("the page");
    let toml = page.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).expect("a description");
    let dir = tempfile::tempdir().expect("a directory");
    let path = spoilt(dir.path(), &[], &[]);
    fs::write(&path, toml).expect("a file");
    let read = file::read(&path).expect("the page's robot");
    assert_eq!((read.robot.posture.len(), read.robot.joints[4].effort), (1, 12.0));
    assert!(matches!(read.robot.links[0].shapes[..], [Shape::Capsule { .. }]), "{:?}", read.robot.links[0].shapes);
    for key in [
        "name", "urdf", "arm", "fingers", "reach_m", "fixed", "tool", "ready", "hand", "posture", "motors", "joints", "shapes",
        "packages",
    ] {
        assert!(toml.contains(key), "{key} is not on the page");
    }
}

fn hilt(words: &[&str]) -> Command {
    let mut command = Command::cargo_bin("hilt").expect("the binary");
    command.args(words);
    command
}

#[test]
fn check_says_what_is_doubtful_and_draws_the_robot() {
    let dir = tempfile::tempdir().expect("a directory");
    let said = |path: &Path| {
        let output = hilt(&["robot", "check", path.to_str().expect("plain")]).output().expect("it runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).expect("text")
    };
    let sound = said(Path::new("fixtures/robots/five.toml"));
    assert!(sound.contains("nothing doubtful") && sound.contains("opposing fingers: left and right"), "{sound}");
    assert!(sound.contains("trial, pick-up: the demonstrator solves "), "{sound}");
    assert!(sound.contains("0.45 m") && sound.contains('#'), "{sound}");
    let doubtful = spoilt(
        dir.path(),
        &[
            ("xyz_m = [0.0, 0.0, 0.11]", "xyz_m = [0.0, 0.0, 0.03]"),
            ("armature = 0.1", "armature = 0.0"),
            ("friction = 2.0", ""),
            ("0.44781, 1.64861", "0.44781, 1.2"),
        ],
        &[
            ("velocity=\"0.2\" effort=\"20\"", "velocity=\"0.2\" effort=\"900\""),
            ("effort=\"60\"", "effort=\"2\""),
            ("ixx=\"0.02\" iyy=\"0.02\"", "ixx=\"0.09\" iyy=\"0.02\""),
            ("<axis xyz=\"0 -1 0\"/>", "<axis xyz=\"0 1 0\"/>"),
        ],
    );
    let said = said(&doubtful);
    for part in [
        "no reflected inertia (armature) in the motors of turn, shoulder, elbow, bend, roll",
        "armature = 0.1 under [motors.arm]",
        "no dry friction in the motors of left, right",
        "finger left presses with 900 N",
        "effort = 80.00 under [joints.left]",
        "trials of pick-up",
        "leans",
        "shoulder bears",
        "link upper: moments of inertia",
        "no two fingers close on each other",
        "the tool point lies inside of link palm",
    ] {
        assert!(said.contains(part), "{part} is not in {said}");
    }

    let png = dir.path().join("five.png");
    let (five, untried) = ("fixtures/robots/five.toml", ["--episodes", "0", "--json"]);
    let said =
        hilt(&[&["robot", "check", five, "--png", png.to_str().expect("plain")][..], &untried].concat()).assert().success();
    assert!(String::from_utf8_lossy(&said.get_output().stdout).contains("\"trial\": null"), "{said}");
    hilt(&["robot", "check", five, "--task", "juggle"]).assert().code(2);
    assert!(fs::read(&png).expect("a picture").starts_with(b"\x89PNG"));
    hilt(&["robot", "check", "puma"]).assert().code(2);
    hilt(&["robot", "check", "gone.toml"]).assert().code(1);
}

/// What `hilt robot draft` says of a URDF.
fn drafted(urdf: &Path) -> String {
    let output = hilt(&["robot", "draft", urdf.to_str().expect("plain")]).output().expect("it runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

/// From a URDF alone to a robot that grasps: with six joints and a thumb against two fingers, with fingers that slide, with five joints, a mesh and a
/// camera that nods.
#[test]
fn a_draft_from_the_urdf_alone_is_a_robot_that_grasps() {
    let dir = tempfile::tempdir().expect("a directory");
    let built_in = Path::new("pipelines/robots");
    for (name, from) in [("jaco", built_in), ("ur5e", built_in), ("five", Path::new("fixtures/robots"))] {
        let urdf = dir.path().join(name).with_extension("urdf");
        fs::copy(from.join(name).with_extension("urdf"), &urdf).expect("a file");
        fs::copy("fixtures/robots/wrist.stl", dir.path().join("wrist.stl")).expect("a file");
        let toml = urdf.with_extension("toml");
        fs::write(&toml, drafted(&urdf)).expect("a file");
        let (known, made) = (file::read(&from.join(name).with_extension("toml")), file::read(&toml));
        let (known, made) = (known.expect("a robot").robot, made.expect("a robot").robot);
        let joints = |robot: &Robot| robot.joints.iter().map(|joint| joint.name.clone()).collect::<Vec<_>>();
        assert_eq!((made.arm, joints(&made)), (known.arm, joints(&known)), "{name}");
        // The tool is between the pads, where a person put it, to 2 cm; and it waits with the hand down.
        let (of_draft, of_person) = (nalgebra::Vector3::from(made.tool_m), nalgebra::Vector3::from(known.tool_m));
        assert!((of_draft - of_person).norm() < 0.0201, "{name}: {of_draft} for {of_person}");
        let tool = made.tool_pose(&made.ready);
        assert!((tool.rotation * nalgebra::Vector3::z()).angle(&nalgebra::Vector3::z()) < 1e-3, "{name}: {tool}");

        let said = hilt(&["robot", "check", toml.to_str().expect("plain"), "--json"]).output().expect("it runs").stdout;
        let said: serde_json::Value = serde_json::from_slice(&said).expect("JSON");
        assert!(said["trial"]["solved"].as_u64() >= Some(18), "{name}: {said}");
    }
}

#[test]
fn what_cannot_be_drafted_is_refused() {
    let dir = tempfile::tempdir().expect("a directory");
    let of = |urdf: &[(&str, &str)]| {
        spoilt(dir.path(), &[], urdf);
        file::draft(&dir.path().join("five.urdf"), &Interrupt::default()).map_err(|why| why.to_string())
    };
    assert!(of(&[]).is_ok_and(|toml| toml.contains("fingers = [\"left\", \"right\"]") && toml.contains("camera_tilt = 0.0")));
    for (spoiling, part) in [
        // One jaw against a fixed one: nothing branches off.
        (
            &[
                ("name=\"right\" type=\"prismatic\"", "name=\"right\" type=\"fixed\""),
                ("name=\"camera_tilt\" type=\"revolute\"", "name=\"camera_tilt\" type=\"fixed\""),
            ][..],
            "no two joints branch off",
        ),
        (&[("<axis xyz=\"0 -1 0\"/>", "<axis xyz=\"1 0 0\"/>")], "no two of the 3 fingers close on each other"),
        (&[("package://five_description/wrist.stl", "package://five_description/gone.stl")], "gone.stl is not there"),
        (&[("<parent link=\"foot\"/>", "<parent link=\"palm\"/>")], "loop"),
    ] {
        let why = of(spoiling).expect_err("refused");
        assert!(why.contains(part), "{part} is not in {why}");
    }
    hilt(&["robot", "draft", "gone.urdf"]).assert().code(1);
}

/// The package of a mesh may stand above the directory in which one works.
#[test]
fn a_package_is_found_above_the_working_directory() {
    let dir = tempfile::tempdir().expect("a directory");
    let package = dir.path().join("five_description");
    fs::create_dir_all(package.join("urdf")).expect("a directory");
    spoilt(&package.join("urdf"), &[("five_description = \".\"", "")], &[]);
    fs::rename(package.join("urdf/wrist.stl"), package.join("wrist.stl")).expect("it can be moved");
    hilt(&["robot", "check", "five.toml", "--episodes", "0"]).current_dir(package.join("urdf")).assert().success();
}

/// A robot that nobody has, from files outside of the library: planned, executed in contact physics, recorded and read back.
#[test]
fn a_robot_of_ones_own_demonstrates_all_tasks() {
    let dir = tempfile::tempdir().expect("a directory");
    let five = fs::canonicalize("fixtures/robots/five.toml").expect("the fixture");
    let five = five.to_str().expect("plain");
    for task in ["pick-up", "pick-and-place", "stack"] {
        let at = |name: &str| dir.path().join(task).join(name).to_str().expect("plain").to_string();
        let own = ["--task", task, "--robot", five, "--quiet"];
        let run = |words: &[&str]| hilt(&[words, &own[..]].concat()).assert().success();
        run(&["plan", "--episodes", "4", "--out", &at("plans.parquet")]);
        run(&["simulate", "--plans", &at("plans.parquet"), "--out", &at("recordings")]);
        for index in 0..4 {
            let (episode, _) = recording::read(&dir.path().join(task).join("recordings").join(recording::file_name(index)))
                .expect("a recording");
            assert!(episode.success, "{task} {index}: {:?}", episode.failure);
            assert_eq!((episode.scene.robot.name.as_str(), episode.last.state.q.len()), ("five", 7));
        }
        // What one robot did is no other's.
        let other = hilt(&["convert", "--task", task, "--recordings", &at("recordings"), "--out", &at("dataset")])
            .output()
            .expect("it runs");
        let said = String::from_utf8_lossy(&other.stderr);
        assert!(
            !other.status.success() && said.contains("was made by robot five, but jaco is asked for; give --robot five"),
            "{said}"
        );
        run(&["convert", "--recordings", &at("recordings"), "--out", &at("dataset")]);
        let found = dataset::read(&dir.path().join(task).join("dataset/train")).expect("a dataset");
        assert_eq!((found.layout.action_dim(), found.layout.action[1].entries[0].as_str()), (7, "left.velocity_m_s"));
        run(&[
            "train",
            "--method",
            "bc",
            "--dataset",
            &at("dataset"),
            "--out",
            &at("policy.safetensors"),
            "--set",
            "train.warm_start_updates=20",
            "--set",
            "train.epochs=1",
            "--set",
            "train.min_updates=0",
            "--set",
            "train.select_episodes=1",
        ]);
        run(&["evaluate", "--episodes", "2", "--policy", &at("policy.safetensors")]);
        let network = at("policy.safetensors");
        let other = hilt(&["evaluate", "--task", task, "--episodes", "1", "--policy", &network]).output().expect("it runs");
        let said = String::from_utf8_lossy(&other.stderr);
        assert!(!other.status.success() && said.contains("was made by robot five, but jaco is asked for"), "{said}");
    }
}

/// `docs/how-data-flow.md`, followed.
#[test]
fn the_chain_of_the_page_runs_and_its_rows_are_what_it_says() {
    let page = fs::read_to_string("docs/how-data-flow.md").expect("the page");
    let chain = page.split("```sh\n").nth(1).and_then(|rest| rest.split("```").next()).expect("a chain of commands");
    let dir = tempfile::tempdir().expect("a directory");
    spoilt(dir.path(), &[], &[]);
    let bin = Path::new(env!("CARGO_BIN_EXE_hilt")).parent().expect("a directory").display().to_string();
    let path = format!("{bin}:{}", std::env::var("PATH").expect("set"));
    let ended = std::process::Command::new("bash").args(["-euc", chain]).env("PATH", path).current_dir(dir.path()).output();
    let ended = ended.expect("bash");
    assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
    for file in ["plans.parquet", "dynamics.safetensors", "policy.safetensors", "evaluation.json", "rollouts/episode-00001.mcap"]
    {
        assert!(dir.path().join(file).is_file(), "{file}");
    }
    let layout = dataset::read(&dir.path().join("dataset/train")).expect("a dataset").layout;
    let rows = [("state", &layout.state), ("action", &layout.action)];
    for (row, span) in rows.into_iter().flat_map(|(row, spans)| spans.iter().map(move |span| (row, span))) {
        let holds = serde_json::to_value(span.holds).expect("a name");
        let line = format!("| {row} | {} | {} | {} |", span.name, holds.as_str().expect("a name"), span.entries.join(", "));
        assert!(page.contains(&line), "the page does not have: {line}");
    }
}
