//! Same seed, same bytes: in any directory, with any number of threads. Another seed, other content.

use crate::runs::{HILT, Run, STAGES, contents, hilt, text};
use hilt::data::{recording, table_file, weights};
use std::process::Command;

/// All stages and pictures.
fn whole(task: &'static str, seed: u64, threads: &str) -> Run {
    let run = Run::new(task, seed).all(&["--threads", threads]);
    for (format, name) in [("--gif", "a.gif"), ("--png", "a.png")] {
        let small = ["--threads", threads, "--width", "120", "--height", "90"].map(String::from);
        assert_eq!(hilt(run.render(format, name).into_iter().chain(small).collect()).status.code(), Some(0));
    }
    run
}

fn the_same_bytes(task: &'static str) {
    let (one, two) = (whole(task, 3, "1"), whole(task, 3, "2"));
    let (here, there) = (contents(one.path()), contents(two.path()));
    let names: Vec<_> = here.keys().collect();
    assert_eq!(names, there.keys().collect::<Vec<_>>());
    for name in [
        "plans.parquet",
        "recordings/episode-00003.mcap",
        "dataset/train/data/chunk-000/file-000.parquet",
        "dynamics.safetensors",
        "dynamics.errors.parquet",
        "dynamics.pretraining.parquet",
        "policy.safetensors",
        "policy.training.parquet",
        "evaluation.json",
        "evaluation.episodes.parquet",
        "a.gif",
        "a.png",
    ] {
        assert!(names.iter().any(|n| n.as_os_str() == name), "{name} is missing: {names:?}");
    }
    for (name, bytes) in &here {
        assert!(there[name] == *bytes, "{task}: {} differs between runs", name.display());
    }
}

#[test]
fn pick_up_gives_the_same_bytes() {
    the_same_bytes("pick-up");
}

#[test]
fn pick_and_place_gives_the_same_bytes() {
    the_same_bytes("pick-and-place");
}

#[test]
fn stack_gives_the_same_bytes() {
    the_same_bytes("stack");
}

#[test]
fn another_seed_gives_other_content() {
    let (one, two) = (whole("pick-up", 3, "2"), whole("pick-up", 4, "2"));
    // Beyond the seed that the provenance names.
    let tables = |run: &Run, name: &str| table_file::read(&run.at(name)).expect("a table").0;
    for name in [
        "plans.parquet",
        "dynamics.pretraining.parquet",
        "dynamics.errors.parquet",
        "policy.training.parquet",
        "evaluation.episodes.parquet",
    ] {
        assert_ne!(tables(&one, name), tables(&two, name), "{name}");
    }
    let episode = |run: &Run| recording::read(&run.at("recordings/episode-00000.mcap")).expect("a recording").0;
    assert_ne!(episode(&one).steps[0].executed, episode(&two).steps[0].executed);
    for (file, kind) in [("dynamics.safetensors", "dynamics"), ("policy.safetensors", "policy")] {
        let tensors = |run: &Run| weights::read(&run.at(file), kind).expect("weights").0;
        assert_ne!(tensors(&one), tensors(&two), "{file}");
    }
}

/// What a processor without fused multiply-add would run. `tests/qemu.sh` runs the whole binary as such a processor.
#[test]
fn every_kernel_gives_the_same_bytes() {
    let fastest = Run::new("stack", 5).all(&["--set", "train.epochs=2"]);
    let portable = Run::new("stack", 5);
    for stage in STAGES {
        let mut command = Command::new(HILT);
        command.args(portable.words(stage)).args(["--set", "train.epochs=2"]).env("HILT_KERNEL", "portable");
        let output = command.output().expect("the binary runs");
        assert!(matches!(output.status.code(), Some(0 | 3)), "{stage}: {}", text(&output.stderr));
    }
    let (here, there) = (contents(fastest.path()), contents(portable.path()));
    assert_eq!(here.keys().collect::<Vec<_>>(), there.keys().collect::<Vec<_>>());
    for (name, bytes) in &here {
        assert!(there[name] == *bytes, "{} differs between kernels", name.display());
    }
}

#[test]
fn a_kernel_that_does_not_exist_is_refused() {
    let output =
        Command::new(HILT).args(["settings", "--task", "stack"]).env("HILT_KERNEL", "sse9").output().expect("the binary runs");
    assert_eq!(output.status.code(), Some(2));
    let words = text(&output.stderr);
    assert!(words.starts_with("error: HILT_KERNEL=\"sse9\" names no kernel") && words.lines().count() == 1, "{words}");
    assert!(output.stdout.is_empty());
}
