//! Where outputs go: nothing of the user's is replaced, removed or lost that the command does not replace on purpose.

use crate::runs::{HILT, Run, STAGES, contents, hilt, text};
use std::fs::{self, Permissions};
use std::os::unix::fs::{FileTypeExt, PermissionsExt, symlink};
use std::path::Path;
use std::process::{Command, Output};

fn words(of: &[&str]) -> Vec<String> {
    of.iter().map(|w| w.to_string()).collect()
}

/// The arguments of a stage with another value behind a flag, or with the flag added.
fn with(run: &Run, stage: &str, flag: &str, value: &str) -> Vec<String> {
    let mut words = run.words(stage);
    match words.iter().position(|w| w == flag) {
        Some(at) => words[at + 1] = value.into(),
        None => words.extend([flag.into(), value.into()]),
    }
    words
}

fn done(output: &Output) {
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
}

/// Runs a command that must be refused as wrong usage, before any work.
fn refused_as_usage(run: &Run, words: Vec<String>, says: &[&str]) {
    let before = contents(run.path());
    let output = hilt(words.clone());
    run.refused(&format!("{words:?}"), &output, &before, says);
    assert_eq!(output.status.code(), Some(2), "{words:?}: {}", text(&output.stderr));
}

#[test]
fn an_output_that_is_an_input_or_lies_in_one_is_refused() {
    let run = Run::finished();
    let [policy, plans, dataset] = ["policy.safetensors", "plans.parquet", "dataset"].map(|name| run.name(name));
    fs::copy(run.at("recordings/episode-00000.mcap"), run.at("r.png")).expect("copied");
    symlink("plans.parquet", run.at("link.log")).expect("linked");
    fs::hard_link(run.at("plans.parquet"), run.at("hard.log")).expect("linked");
    for (words, says) in [
        (words(&["render", &run.name("r.png"), "--png", "--out", &run.name("r.png")]), "is "),
        (with(&run, "train", "--out", &run.name("dynamics.safetensors")), "is "),
        (with(&run, "train", "--metrics", &format!("{dataset}/train/m.parquet")), "lies in"),
        (with(&run, "evaluate", "--record", &run.path().display().to_string()), "would replace"),
        (words(&["inspect", &plans, "--log", &run.name("link.log")]), "is "),
        (words(&["inspect", &plans, "--log", &run.name("hard.log")]), "is "),
        (words(&["inspect", &policy, "--log", &policy]), ".log"),
    ] {
        refused_as_usage(&run, words, &[says]);
    }
    fs::write(run.at("mine.toml"), "task = \"pick-up\"\n").expect("written");
    let name = run.name("mine.toml");
    refused_as_usage(&run, words(&["settings", "--pipeline", &name, "--log", &name]), &["mine.log"]);
}

#[test]
fn an_output_that_holds_another_artefact_is_refused() {
    let run = Run::finished();
    for (from, to) in [("plans.parquet", "x.episodes.parquet"), ("policy.safetensors", "y.checkpoint.safetensors")] {
        fs::copy(run.at(from), run.at(to)).expect("copied");
    }
    fs::write(run.at("thesis.parquet"), "years of work").expect("written");
    fs::write(run.at("theirs.json"), "{\"a\": 1}").expect("written");
    for (words, says) in [
        (with(&run, "evaluate", "--out", &run.name("x.json")), "an artefact of hilt plan"),
        (with(&run, "evaluate", "--record", &run.name("recordings")), "an artefact of hilt simulate"),
        (with(&run, "evaluate", "--out", &run.name("theirs.json")), "hilt did not write"),
        (with(&run, "train", "--out", &run.name("y.safetensors")), "weights of another kind, a policy"),
        (with(&run, "train", "--metrics", &run.name("plans.parquet")), "an artefact of hilt plan"),
        (with(&run, "pretrain", "--out", &run.name("policy.safetensors")), "an artefact of hilt train"),
        (with(&run, "plan", "--out", &run.name("thesis.parquet")), "a file of another format"),
    ] {
        refused_as_usage(&run, words, &[says, "would be lost"]);
    }
    fs::write(run.at("x.unfinished"), "mine").expect("written");
    let before = contents(run.path());
    let output = hilt(with(&run, "plan", "--out", &run.name("x.parquet")));
    run.refused("a file in the pieces' place", &output, &before, &["x.unfinished: is a file"]);
    // A half of what convert has split is not hilt dataset's to replace, nor is what that has made convert's.
    let [dataset, train, half] = ["dataset", "dataset/train", "dataset/validation"].map(|name| run.name(name));
    let filter = words(&["dataset", "filter", &train, "--success", "--out", &half]);
    refused_as_usage(&run, filter, &["a dataset of hilt convert", "would be lost"]);
    let [merged, split] = ["merged", "split"].map(|name| run.name(name));
    done(&hilt(words(&["dataset", "merge", &train, &half, "--out", &merged])));
    let before = contents(run.path());
    let output = hilt(with(&run, "pretrain", "--dataset", &merged));
    run.refused("one dataset", &output, &before, &["is one dataset", "hilt dataset split"]);
    done(&hilt(words(&["dataset", "split", &merged, "--out", &split])));
    refused_as_usage(&run, with(&run, "convert", "--out", &split), &["a dataset of hilt dataset", "would be lost"]);
    done(&hilt(words(&["dataset", "split", &merged, "--out", &split])));
    assert!(run.at(&dataset).is_dir());
    // What was cut short is made again.
    let plans = fs::read(run.at("plans.parquet")).expect("plans");
    for damaged in [&plans[..plans.len() / 2], b""] {
        fs::write(run.at("plans.parquet"), damaged).expect("damaged");
        done(&hilt(run.words("plan")));
        assert_eq!(fs::read(run.at("plans.parquet")).expect("plans"), plans);
    }
}

#[test]
fn pictures_and_logs_of_somebody_else_stay() {
    let run = Run::finished();
    let recording = run.name("recordings/episode-00000.mcap");
    let drawing = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"9px\"><g aria-label=\"tea\"/></svg>";
    let of_others: [(&str, &[u8]); 4] = [
        ("mine.gif", b"GIF89a mine"),
        ("mine.png", b"\x89PNG\r\n\x1a\n mine"),
        ("mine.log", b"Monday, with tea\n"),
        ("mine.svg", drawing.as_bytes()),
    ];
    for (name, bytes) in of_others {
        fs::write(run.at(name), bytes).expect("written");
    }
    let render = |name: &str| words(&["render", &recording, "--width", "64", "--height", "48", "--out", &run.name(name)]);
    for (of, says) in [
        (render("mine.gif"), "a file that hilt did not write"),
        (render("mine.png"), "a file that hilt did not write"),
        (words(&["inspect", &recording, "--log", &run.name("mine.log")]), "is there already"),
        (words(&["plot", &run.name("policy.training.parquet"), "--out", &run.name("mine.svg")]), "is there already"),
    ] {
        refused_as_usage(&run, of, &[says, "would be lost"]);
    }
    for name in ["own.gif", "own.png"] {
        done(&hilt(render(name)));
        done(&hilt(render(name)));
    }
    let plot = words(&["plot", &run.name("policy.training.parquet"), "--out", &run.name("own.svg")]);
    done(&hilt(plot.clone()));
    done(&hilt(plot));
    // A log is of the last command, with the reason for which that failed.
    let log = run.name("own.log");
    done(&hilt(with(&run, "plan", "--log", &log)));
    let output = hilt(words(&["inspect", "nowhere.parquet", "--log", &log]));
    assert_eq!(output.status.code(), Some(1));
    let said = fs::read_to_string(&log).expect("a log");
    assert!(said.starts_with("error: nowhere.parquet"), "{said}");
    done(&hilt(with(&run, "plan", "--log", &log)));
}

#[test]
fn two_outputs_of_a_command_on_one_path_are_refused() {
    let run = Run::finished();
    let one = run.name("one");
    refused_as_usage(&run, with(&run, "train", "--metrics", &run.name("policy.safetensors")), &["must end in .parquet"]);
    let log = words(&["--record", &one, "--log", &format!("{one}/words.log")]);
    refused_as_usage(&run, [run.words("evaluate"), log].concat(), &["to one place"]);
    symlink("p.training.parquet", run.at("m.parquet")).expect("linked");
    let out = with(&run, "train", "--out", &run.name("p.safetensors"));
    done(&hilt([out.clone(), words(&["--metrics", &run.name("p.training.parquet")])].concat()));
    refused_as_usage(&run, with(&run, "evaluate", "--out", &run.name("e.parquet")), &["must end in .json", "e.json"]);
    refused_as_usage(&run, with(&run, "train", "--out", &run.name("policy-0.0")), &["policy-0.0.safetensors"]);
    refused_as_usage(&run, with(&run, "train", "--out", &run.name("model.pt")), &["model.safetensors"]);
}

#[test]
fn what_goes_beside_an_output_has_its_name() {
    let mut run = Run::finished();
    for seed in [0, 1] {
        run.seed = seed;
        done(&hilt(with(&run, "train", "--out", &run.name(&format!("policy-0.{seed}.safetensors")))));
    }
    for name in ["policy-0.0", "policy-0.1"] {
        assert!(run.at(format!("{name}.training.parquet")).is_file(), "{name}");
    }
    let read = |name: &str| fs::read(run.at(name)).expect("metrics");
    assert_ne!(read("policy-0.0.training.parquet"), read("policy-0.1.training.parquet"));
    assert!(run.at("policy.training.parquet").is_file() && run.at("evaluation.episodes.parquet").is_file());
}

#[test]
fn devices_and_pipes_are_written_into_and_links_and_permissions_stay() {
    let run = Run::finished();
    done(&hilt(with(&run, "train", "--metrics", "/dev/null")));
    assert!(fs::metadata("/dev/null").expect("there").file_type().is_char_device(), "/dev/null was replaced");

    // Nothing goes beside a device.
    done(&hilt(with(&run, "evaluate", "--out", "/dev/null")));
    done(&hilt(with(&run, "train", "--out", "/dev/null")));
    let beside = |entry: &fs::DirEntry| entry.file_name().to_string_lossy().starts_with("null.");
    assert!(!fs::read_dir("/dev").expect("readable").flatten().any(|entry| beside(&entry)));
    assert!(fs::metadata("/dev/null").expect("there").file_type().is_char_device(), "/dev/null was replaced");

    let output = hilt(with(&run, "plan", "--out", "/dev/stdout"));
    done(&output);
    assert_eq!(output.stdout, fs::read(run.at("plans.parquet")).expect("plans"));
    let pipe = run.name("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().expect("mkfifo runs").success());
    let reader = Command::new("cat").arg(&pipe).stdout(std::process::Stdio::piped()).spawn().expect("cat runs");
    done(&hilt(with(&run, "plan", "--out", &pipe)));
    assert_eq!(reader.wait_with_output().expect("read").stdout, output.stdout);
    assert!(fs::metadata(&pipe).expect("there").file_type().is_fifo(), "the pipe was replaced");

    fs::create_dir(run.at("store")).expect("made");
    for name in ["plans.parquet", "recordings"] {
        fs::rename(run.at(name), run.at("store").join(name)).expect("moved");
        symlink(Path::new("store").join(name), run.at(name)).expect("linked");
        fs::set_permissions(run.at("store").join(name), Permissions::from_mode(0o750)).expect("set");
    }
    done(&hilt(run.words("plan")));
    done(&hilt(run.words("simulate")));
    for name in ["plans.parquet", "recordings"] {
        assert!(run.at(name).is_symlink(), "{name} is no link any more");
        let mode = fs::metadata(run.at(name)).expect("there").permissions().mode() & 0o777;
        assert_eq!(mode, 0o750, "{name}");
    }
}

#[test]
fn files_of_others_in_an_output_directory_stay() {
    let run = Run::finished();
    fs::create_dir(run.at("dataset/train/videos")).expect("made");
    for (foreign, stage) in [
        ("dataset/train/README.md", "convert"),
        ("dataset/train/videos/a.mp4", "convert"),
        ("recordings/notes.txt", "simulate"),
        ("recordings/old/episode-00000.mcap", "simulate"),
    ] {
        fs::create_dir_all(run.at(foreign).parent().expect("below the run")).expect("made");
        fs::write(run.at(foreign), "mine").expect("written");
        let inner = foreign.split_once('/').expect("below a directory").1;
        run.refuses(run.words(stage), &[inner]);
        fs::remove_file(run.at(foreign)).expect("removed");
    }
}

#[test]
fn litter_of_file_browsers_neither_counts_nor_stands_in_the_way() {
    let run = Run::finished();
    let hashes = |name: &str| text(&hilt(words(&["inspect", "--json", &run.name(name)])).stdout);
    let before = (hashes("dataset"), hashes("dynamics.safetensors"));
    for dir in ["recordings", "dataset", "dataset/train", "dataset/validation/meta"] {
        for litter in [".DS_Store", "Thumbs.db", "desktop.ini", ".directory", ".nfs0001", "._x"] {
            fs::write(run.at(dir).join(litter), "litter").expect("written");
        }
    }
    fs::write(run.at("recordings/.gitignore"), "*.mcap").expect("written");
    for stage in &STAGES[1..] {
        done(&hilt(run.words(stage)));
        if *stage == "simulate" {
            fs::write(run.at("recordings/.DS_Store"), "litter").expect("written");
        }
    }
    assert_eq!((hashes("dataset"), hashes("dynamics.safetensors")), before);
    assert_eq!(fs::read_to_string(run.at("recordings/.gitignore")).expect("kept"), "*.mcap");
}

/// Runs a stage in a working directory.
fn inside(dir: &Path, words: Vec<String>) -> Output {
    Command::new(HILT).current_dir(dir).args(words).output().expect("the binary runs")
}

#[test]
fn a_place_that_cannot_be_taken_is_known_before_the_work() {
    let run = Run::finished();
    run.refuses(with(&run, "plan", "--out", &format!("{}/", run.name("new"))), &["names a directory"]);
    // An empty working directory is filled; one with an older artefact cannot be exchanged.
    let empty = run.at("empty");
    fs::create_dir(&empty).expect("made");
    done(&inside(&empty, with(&run, "simulate", "--out", ".")));
    assert_eq!(contents(&empty), contents(&run.at("recordings")));
    let before = contents(run.path());
    for (dir, out) in [("recordings", "."), ("recordings", "../recordings"), ("dataset/train", "..")] {
        let stage = if dir == "recordings" { "simulate" } else { "convert" };
        let output = inside(&run.at(dir), with(&run, stage, "--out", out));
        run.refused(&format!("{stage} in {dir}"), &output, &before, &["the working directory or above it"]);
        assert!(!text(&output.stderr).contains(" per second"), "refused after the work");
    }
}

#[test]
fn a_mount_point_is_filled_or_refused_before_the_work() {
    let run = Run::finished();
    let before = contents(&run.at("recordings"));
    let script = "mkdir \"$0\"; mount -t tmpfs tmpfs \"$0\" || exit 77; \"$@\" || exit; ls -A \"$0\"; \"$@\"; echo \"code $?\"";
    let mount = run.name("mount");
    let output = Command::new("unshare")
        .args(["-rm", "bash", "-c", script, &mount, HILT])
        .args(with(&run, "simulate", "--out", &mount))
        .output();
    let output = match output {
        Ok(output) if output.status.code() != Some(77) && !text(&output.stderr).contains("unshare") => output,
        _ => return println!("skipped: mounting is not permitted here"),
    };
    let names: Vec<String> = before.keys().map(|name| name.display().to_string()).collect();
    assert_eq!(text(&output.stdout), format!("{}\ncode 1\n", names.join("\n")), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("a mount point"), "{}", text(&output.stderr));
}

#[test]
fn what_a_killed_process_left_is_removed_by_the_next() {
    let run = Run::finished();
    let before = contents(run.path());
    let leftovers = || {
        fs::read_dir(run.path())
            .expect("readable")
            .flatten()
            .filter(|e| e.file_name().to_string_lossy().starts_with(".hilt-"))
            .count()
    };
    let words = with(&run, "evaluate", "--record", &run.name("rollouts"));
    let mut killed = Command::new(HILT).args(words).args(["--episodes", "5000", "--quiet"]).spawn().expect("the binary runs");
    while leftovers() == 0 {
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    std::thread::sleep(std::time::Duration::from_millis(200));
    // While it runs, another stage in the same directory leaves its files alone.
    done(&hilt(run.words("plan")));
    assert_eq!(leftovers(), 1);
    killed.kill().expect("killed");
    killed.wait().expect("ended");
    assert_eq!(leftovers(), 1, "a killed process cannot clean up");
    done(&hilt(run.words("plan")));
    run.unchanged("the next stage", &before);
}

#[test]
fn provenance_names_the_bytes_that_were_read() {
    let run = Run::finished();
    let read = fs::read(run.at("policy.safetensors")).expect("weights");
    let child = Command::new(HILT)
        .args(run.words("evaluate"))
        .args(["--episodes", "3000", "--quiet"])
        .stdout(std::process::Stdio::null())
        .spawn();
    std::thread::sleep(std::time::Duration::from_millis(300));
    let mut other = run.words("train");
    other.extend(words(&["--method", "bc"]));
    done(&hilt(other));
    assert!(read != fs::read(run.at("policy.safetensors")).expect("weights"), "the policy was replaced in between");
    assert!(child.expect("the binary runs").wait().expect("ended").success());
    let (_, origin) = hilt::data::json_file::read(&run.at("evaluation.json")).expect("a summary");
    assert_eq!(origin.inputs["policy"], hilt::data::ContentHash::of(&read).to_string());
}
