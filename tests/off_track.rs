//! The scenes off the beaten track: each differs from the ordinary stack in what its name says, and in nothing else.

use hilt::config::{Pipeline, Preset, Source, Stage};
use hilt::seed::stream;
use hilt::task::built_in::stack;
use hilt::tasks::draw_scene;
use std::path::Path;

/// Each pipeline with the lines of the settings that it changes.
const VARIATIONS: [(&str, &[&str]); 6] = [
    ("noise-x3", &["noise_variance = 0.009"]),
    ("yaw", &["yaw = true"]),
    ("base-moved", &["base_xy_m = [[0.38, 0.52], [0.3, 0.36]]"]),
    ("friction", &["friction = [0.4, 1.2]"]),
    ("mass", &["block_mass_kg = [0.05, 0.3]"]),
    ("wide-spawn", &["spawn_x_m = [0.27, 0.67]", "spawn_y_m = [-0.2, 0.2]"]),
];

fn settings(source: &Source) -> (Pipeline, Vec<String>) {
    let pipeline = Pipeline::load(source, &[]).expect("a pipeline that comes with hilt");
    // What is learned from the demos, and how, is taken from the ordinary pipeline.
    let stages = [Stage::Convert, Stage::Evaluate].map(|stage| pipeline.to_toml(Some(stage)).expect("TOML"));
    let lines = stages.iter().flat_map(|text| text.lines()).map(String::from).collect();
    (pipeline, lines)
}

#[test]
fn each_changes_what_its_name_says_and_has_room() {
    let (_, ordinary) = settings(&Source::BuiltIn(stack().into(), Preset::Best));
    let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines/off-track");
    assert_eq!(std::fs::read_dir(&dir).expect("readable").count(), VARIATIONS.len(), "a file without a line in this test");
    for (name, changes) in VARIATIONS {
        let (pipeline, lines) = settings(&Source::File(dir.join(format!("{name}.toml")), None));
        let changed: Vec<&String> = lines.iter().filter(|line| !ordinary.contains(line)).collect();
        assert_eq!(changed, changes, "{name}");
        assert_eq!(lines.len(), ordinary.len(), "{name}");
        for index in 0..50 {
            draw_scene(&pipeline.robot, &stack(), &pipeline.scene, &mut stream(0, "off-track test", index))
                .expect("there is room");
        }
    }
}
