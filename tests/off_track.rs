//! The scenes off the beaten track (`hilt experiment off-track`): each differs from the ordinary stack in what its name says, and in nothing else.

use hilt::config::{Pipeline, Preset, Source, Stage};
use hilt::experiment::{Experiment, Overrides, find};
use hilt::seed::stream;
use hilt::task::built_in::stack;
use hilt::tasks::draw_scene;

/// Each variation with the lines of the settings that it changes.
const VARIATIONS: [(&str, &[&str]); 7] = [
    ("ordinary", &[]),
    ("noise-x3", &["noise_variance = 0.009"]),
    ("yaw", &["yaw = true"]),
    ("base-moved", &["base_xy_m = [[0.38, 0.52], [0.3, 0.36]]"]),
    ("friction", &["friction = [0.4, 1.2]"]),
    ("mass", &["block_mass_kg = [0.05, 0.3]"]),
    ("wide-spawn", &["spawn_x_m = [0.27, 0.67]", "spawn_y_m = [-0.2, 0.2]"]),
];

fn settings(set: &[String]) -> (Pipeline, Vec<String>) {
    let pipeline = Pipeline::load(&Source::BuiltIn(stack().into(), Preset::Best), set).expect("settings");
    let stages = [Stage::Convert, Stage::Evaluate].map(|stage| pipeline.to_toml(Some(stage)).expect("TOML"));
    let lines = stages.iter().flat_map(|text| text.lines()).map(String::from).collect();
    (pipeline, lines)
}

#[test]
fn each_changes_what_its_name_says_and_has_room() {
    let path = find("off-track").expect("an experiment that comes with hilt");
    let experiment = Experiment::read(&path, &Overrides::default()).expect("an experiment");
    let (_, ordinary) = settings(&[]);
    let (covered, unseen): (Vec<_>, Vec<_>) = experiment.variations.iter().partition(|v| v.name.ends_with("-covered"));
    let names: Vec<&str> = unseen.iter().map(|v| v.name.as_str()).collect();
    assert_eq!(names, VARIATIONS.map(|(name, _)| name), "a variation without a line in this test");
    for (variation, (name, changes)) in unseen.iter().zip(VARIATIONS) {
        let (pipeline, lines) = settings(&variation.set);
        let changed: Vec<&String> = lines.iter().filter(|line| !ordinary.contains(line)).collect();
        assert_eq!(changed, changes, "{name}");
        assert_eq!(lines.len(), ordinary.len(), "{name}");
        for index in 0..50 {
            draw_scene(&pipeline.robot, &stack(), &pipeline.scene, &mut stream(0, "off-track test", index))
                .expect("there is room");
        }
        // What the ordinary policies do not see, the others' demos show.
        let seen = covered.iter().find(|v| v.name == format!("{name}-covered"));
        assert_eq!(
            seen.map(|v| (&v.set, v.stages.len())),
            (name != "ordinary").then_some((&variation.set, Stage::ALL.len())),
            "{name}"
        );
        assert!(name == "ordinary" || variation.stages == [Stage::Evaluate], "{name}");
    }
}
