//! Every stage against files that are missing, damaged, or made for something else, and settings that cannot work.

use crate::runs::{Run, STAGES, contents, hilt};
use std::fs;
use std::path::Path;

/// Which files a command reads.
const READS: [(&str, &str); 10] = [
    ("simulate", "plans.parquet"),
    ("convert", "recordings/episode-00001.mcap"),
    ("pretrain", "dataset/train/meta/info.json"),
    ("pretrain", "dataset/train/meta/stats.json"),
    ("pretrain", "dataset/train/data/chunk-000/file-000.parquet"),
    ("pretrain", "dataset/validation/data/chunk-000/file-000.parquet"),
    ("train", "dataset/train/data/chunk-000/file-000.parquet"),
    ("train", "dataset/validation/meta/info.json"),
    ("train", "dynamics.safetensors"),
    ("evaluate", "policy.safetensors"),
];

/// Artefacts that `inspect` is asked about: what to name, the file that is damaged.
const ARTEFACTS: [(&str, &str); 7] = [
    ("plans.parquet", "plans.parquet"),
    ("recordings", "recordings/episode-00002.mcap"),
    ("dataset", "dataset/validation/data/chunk-000/file-000.parquet"),
    ("dataset/train", "dataset/train/meta/tasks.parquet"),
    ("policy.safetensors", "policy.safetensors"),
    ("evaluation.json", "evaluation.json"),
    ("policy.training.parquet", "policy.training.parquet"),
];

/// Every command with every file it reads.
fn readers(run: &Run) -> Vec<(Vec<String>, &'static str)> {
    let stages = READS.iter().map(|(stage, file)| (run.words(stage), *file));
    let inspect = ARTEFACTS.iter().map(|(named, file)| (vec!["inspect".to_string(), run.name(named)], *file));
    let drawn = "recordings/episode-00000.mcap";
    stages.chain(inspect).chain([(run.render("--png", "a.png"), drawn), (run.render("--gif", "a.gif"), drawn)]).collect()
}

fn damaged(harm: impl Fn(&[u8]) -> Vec<u8>, says: &[&str]) {
    let run = Run::finished();
    for (words, file) in readers(&run) {
        let path = run.at(file);
        let whole = fs::read(&path).expect("a file of the run");
        fs::write(&path, harm(&whole)).expect("damaged");
        run.refuses(words, &[&[file.rsplit('/').next().expect("a name")], says].concat());
        fs::write(&path, whole).expect("mended");
    }
}

#[test]
fn files_cut_short_are_refused() {
    for share in [0.0, 0.4, 0.999] {
        damaged(|whole| whole[..(whole.len() as f64 * share) as usize].to_vec(), &[]);
    }
}

#[test]
fn flipped_bits_are_refused() {
    for share in [0.02, 0.5, 0.97] {
        damaged(
            |whole| {
                let mut bytes = whole.to_vec();
                bytes[(whole.len() as f64 * share) as usize] ^= 0x10;
                bytes
            },
            &[],
        );
    }
}

#[test]
fn files_of_another_kind_are_refused() {
    damaged(|_| b"one, two\n3, 4\n".to_vec(), &[]);
}

#[test]
fn another_schema_version_is_named() {
    let run = Run::finished();
    for (words, file) in readers(&run) {
        // Only info.json speaks for the dataset.
        let file = match file.split_once("/data/").or(file.split_once("/meta/")) {
            Some((root, _)) => format!("{root}/meta/info.json"),
            None => file.to_string(),
        };
        let whole = fs::read(run.at(&file)).expect("a file of the run");
        let mut bytes = whole.clone();
        for at in (0..bytes.len()).filter(|at| whole[*at..].starts_with(b"schema_version")) {
            let digit = at + bytes[at..].iter().position(|b| *b == b'1').expect("a version");
            bytes[digit] = b'6';
        }
        fs::write(run.at(&file), bytes).expect("edited");
        run.refuses(words, &["schema version 6, this hilt reads version 1", "run the stage"]);
        fs::write(run.at(&file), whole).expect("mended");
    }
}

#[test]
fn missing_files_are_named() {
    let run = Run::finished();
    let hidden = run.at("hidden");
    for (words, file) in readers(&run) {
        // A recording fewer is a smaller directory, not a mistake; what is missing then is all of them.
        let file = if words[0] == "convert" || words[1].ends_with("recordings") { "recordings" } else { file };
        fs::rename(run.at(file), &hidden).expect("hidden");
        run.refuses(words, &[file.rsplit('/').next().expect("a name")]);
        fs::rename(&hidden, run.at(file)).expect("back");
    }
    for words in [vec!["inspect".into(), run.name("nothing")], vec!["settings".into(), "--pipeline".into(), run.name("nothing")]]
    {
        run.refuses(words, &["nothing", "cannot read"]);
    }
}

#[test]
fn artefacts_of_another_task_are_refused() {
    let run = Run::finished();
    for stage in &STAGES[1..] {
        let words: Vec<String> = run.words(stage).iter().map(|w| w.replace("pick-up", "stack")).collect();
        assert!(words.contains(&"stack".to_string()), "the path of the run does not hold the task's name");
        run.refuses(words, &["pick-up", "stack"]);
    }
}

#[test]
fn weights_of_another_kind_are_refused() {
    let run = Run::finished();
    let with = |stage: &str, flag: &str, file: &str| {
        run.words(stage).into_iter().chain([flag.to_string(), run.name(file)]).collect::<Vec<_>>()
    };
    fs::copy(run.at("policy.safetensors"), run.at("another.safetensors")).expect("copied");
    for (words, says) in [
        (swapped(&run, "train", "dynamics.safetensors", "another.safetensors"), "policy network, a dynamics network is needed"),
        (swapped(&run, "evaluate", "policy.safetensors", "dynamics.safetensors"), "dynamics network, a policy network is needed"),
        (swapped(&run, "evaluate", "policy.safetensors", "plans.parquet"), "plans.parquet"),
        (swapped(&run, "simulate", "plans.parquet", "policy.training.parquet"), "this is no table of plans"),
    ] {
        run.refuses(words, &[says]);
    }
    run.refuses(with("plan", "--log", "recordings"), &["recordings", "is a directory"]);
}

/// A stage's arguments with another file in one place.
fn swapped(run: &Run, stage: &str, old: &str, new: &str) -> Vec<String> {
    let (old, new) = (run.name(old), run.name(new));
    run.words(stage).into_iter().map(|w| if w == old { new.clone() } else { w }).collect()
}

#[test]
fn unknown_keys_wrong_types_and_numbers_out_of_range_are_refused_by_every_stage() {
    let run = Run::finished();
    for stage in STAGES {
        for (set, says) in [
            ("plan.sped=1", "did you mean plan.speed?"),
            ("plan.speed=\"fast\"", "plan.speed"),
            ("train.rho=7", "train.rho"),
            ("evaluate.episodes=0", "1 to 100000"),
            ("simulate.noise_variance=-0.1", "0 to 1"),
        ] {
            run.refuses(run.words(stage).into_iter().chain(["--set".into(), set.into()]).collect(), &[says]);
        }
    }
    for words in [["--width", "9"], ["--rows", "0"], ["--columns", "1000"]] {
        run.refuses(run.render("--png", "a.png").into_iter().chain(words.map(String::from)).collect(), &["1"]);
    }
    for words in [["--fps", "0"], ["--every", "0"], ["--height", "100000"]] {
        run.refuses(run.render("--gif", "a.gif").into_iter().chain(words.map(String::from)).collect(), &["0"]);
    }
}

#[test]
fn a_spawn_area_out_of_reach_is_named_and_the_old_plans_stay() {
    let run = Run::finished();
    let plan = |sets: &[&str]| {
        let further = sets.iter().flat_map(|set| ["--set".to_string(), set.to_string()]);
        run.words("plan").into_iter().chain(further).collect::<Vec<_>>()
    };
    run.refuses(plan(&["scene.spawn_x_m=[1.2, 1.4]"]), &["no room", "0.295 to 0.68 m", "scene.spawn_x_m"]);
    let wall = "scene.obstacles=[{center_m=[0.47, 0.0, 0.02], size_m=[0.4, 0.4, 0.04]}]";
    run.refuses(plan(&[wall]), &["no room", "scene.spawn_x_m"]);
}

#[test]
fn no_demonstration_left_is_said() {
    let run = Run::finished();
    let noisy = run.words("simulate").into_iter().chain(["--set", "simulate.noise_variance=1.0"].map(String::from)).collect();
    assert_eq!(hilt(noisy).status.code(), Some(0));
    run.refuses(run.words("convert"), &["all 4 episodes were dropped", "convert.keep_failed"]);
    fs::remove_dir_all(run.at("recordings")).expect("removed");
    fs::create_dir(run.at("recordings")).expect("made");
    run.refuses(run.words("convert"), &["recordings", "holds no recording", "hilt simulate"]);
}

#[test]
fn places_that_cannot_be_written_are_refused_before_the_work() {
    let run = Run::finished();
    fs::create_dir(run.at("directory")).expect("made");
    fs::write(run.at("directory/thesis.tex"), "years of work").expect("written");
    let to = |stage: &str, out: &str| {
        let mut words = run.words(stage);
        let at = words.iter().position(|w| w == "--out").expect("every stage has a place");
        words[at + 1] = run.name(out);
        // Work that would take hours: the refusal comes first.
        words.extend(["--set", "pretrain.epochs=100000", "--set", "train.epochs=100000"].map(String::from));
        words
    };
    for stage in STAGES {
        run.refuses(to(stage, "directory"), &["directory"]);
        run.refuses(to(stage, "plans.parquet/inner/name.json"), &["plans.parquet"]);
    }
    for stage in ["simulate", "convert"] {
        run.refuses(to(stage, "directory"), &["thesis.tex", "empty it or choose another place"]);
        run.refuses(to(stage, "policy.safetensors"), &["is a file, a directory is to be written"]);
    }
    run.refuses(run.render("--png", "directory"), &["is a directory, a file is to be written"]);
    assert!(Path::new(&run.name("directory/thesis.tex")).is_file());
}

#[test]
fn what_a_killed_run_left_behind_does_not_stand_in_the_way() {
    let run = Run::finished();
    let before = contents(run.path());
    for name in [".hilt-AbCdEf", "dataset/../.hilt-GhIjKl"] {
        fs::create_dir(run.at(name)).expect("made");
        fs::write(run.at(name).join("episode-00000.mcap"), "half of it").expect("written");
    }
    fs::write(run.at(".hilt-MnOpQr"), "half a file").expect("written");
    for stage in STAGES {
        assert!(matches!(hilt(run.words(stage)).status.code(), Some(0 | 3)), "{stage}");
    }
    let after = contents(run.path());
    for (name, bytes) in before {
        assert!(after[&name] == bytes, "{} is another", name.display());
    }
}

#[test]
fn weights_that_no_stage_can_run_are_refused_by_inspect_too() {
    let run = Run::finished();
    let (tensors, whole, origin) = hilt::data::weights::read(&run.at("policy.safetensors"), "policy").expect("weights");
    for (key, value) in [("hidden", serde_json::json!([0])), ("horizon_steps", serde_json::json!(u32::MAX))] {
        let mut meta = whole.clone();
        meta[key] = value;
        hilt::data::weights::write(&run.at("policy.safetensors"), "policy", &tensors, &meta, &origin).expect("written");
        run.refuses(run.words("evaluate"), &["policy.safetensors", key]);
        run.refuses(vec!["inspect".into(), run.name("policy.safetensors")], &["policy.safetensors", key]);
    }
}
