//! A full disk: a limit on the size of files, and where it may be mounted, a file system of a few kilobytes.

use crate::runs::{HILT, Run, STAGES, contents, text};
use std::process::Command;

/// 1 KiB: less than any artefact. In blocks of `ulimit -f`, which bash counts in KiB.
const SMALL: &str = "1";
/// 96 KiB: some files of a stage fit, not all.
const LARGER: &str = "96";

#[test]
fn a_limit_on_file_sizes_keeps_every_old_artefact() {
    let run = Run::finished();
    let before = contents(run.path());
    let draws = [run.render("--png", "a.png"), run.render("--gif", "a.gif")];
    for words in STAGES.map(|stage| run.words(stage)).into_iter().chain(draws) {
        let output = Command::new("bash")
            .args(["-c", "ulimit -f \"$1\"; shift; exec \"$@\"", "bash", SMALL, HILT])
            .args(&words)
            .output()
            .expect("bash runs");
        run.refused(&format!("{words:?} with {SMALL} KiB"), &output, &before, &["cannot write", "File too large"]);
    }
}

#[test]
fn files_that_belong_together_are_kept_together() {
    let run = Run::finished();
    let before = contents(run.path());
    // The tables fit, the weights do not: neither may take its place.
    let words = |stage: &str, set: &str| run.words(stage).into_iter().chain(["--set".into(), set.into()]).collect::<Vec<_>>();
    for words in [words("pretrain", "pretrain.hidden_units=256"), words("train", "train.hidden_units=256")] {
        let output = Command::new("bash")
            .args(["-c", "ulimit -f \"$1\"; shift; exec \"$@\"", "bash", LARGER, HILT])
            .args(&words)
            .output()
            .expect("bash runs");
        run.refused(&format!("{words:?} with {LARGER} KiB"), &output, &before, &[".safetensors", "cannot write"]);
    }
}

#[test]
fn a_full_file_system_is_left_as_it_was() {
    let run = Run::finished();
    let script =
        "mount -t tmpfs -o size=16k tmpfs \"$0\" || exit 77; echo old > \"$0/old\"; \"$@\"; echo \"code $?\"; ls -A \"$0\"";
    let before = contents(run.path());
    for (stage, name) in
        [("plan", "p.parquet"), ("simulate", "r"), ("convert", "d"), ("pretrain", "m.safetensors"), ("train", "p.safetensors")]
    {
        let mount = tempfile::tempdir().expect("temporary directory");
        let mut words = run.words(stage);
        let at = words.iter().position(|w| w == "--out").expect("every stage has a place");
        words[at + 1] = mount.path().join(name).to_str().expect("UTF-8 path").into();
        // A mount namespace of its own: nothing stays mounted.
        let output =
            Command::new("unshare").args(["-rm", "bash", "-c", script]).arg(mount.path()).arg(HILT).args(&words).output();
        let output = match output {
            Ok(output) if output.status.success() => output,
            _ => return println!("skipped: mounting a small file system is not permitted here"),
        };
        let (stdout, stderr) = (text(&output.stdout), text(&output.stderr));
        assert_eq!(stdout, "code 1\nold\n", "{stage}: {stderr}");
        assert!(stderr.contains("error: ") && stderr.contains("No space left on device"), "{stage}: {stderr}");
        run.unchanged(stage, &before);
    }
}
