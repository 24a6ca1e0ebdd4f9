//! Where the binary is, and when cargo is needed.

use crate::{Run, TINY, command, text};
use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;

/// A program of this name in `dir`.
fn program(dir: &Path, name: &str, script: &str) {
    fs::create_dir_all(dir).expect("made");
    fs::write(dir.join(name), format!("#!/bin/sh\n{script}\n")).expect("written");
    fs::set_permissions(dir.join(name), fs::Permissions::from_mode(0o755)).expect("executable");
}

/// Links to programs, in `dir`; none of the others is found there.
fn only(dir: &Path, names: &[&str]) {
    fs::create_dir_all(dir).expect("made");
    for name in names {
        let found =
            ["/usr/bin", "/bin", "/usr/local/bin"].iter().map(|place| Path::new(place).join(name)).find(|path| path.exists());
        symlink(found.unwrap_or_else(|| panic!("{name} is missing")), dir.join(name)).expect("linked");
    }
}

/// What the Makefile and pipelines/made.sh call.
const NEEDED: [&str; 20] = [
    "awk", "cat", "cp", "env", "bash", "find", "grep", "ln", "make", "mkdir", "mv", "nproc", "rm", "sed", "tail", "touch", "tr",
    "wc", "xargs", "sort",
];

#[test]
fn cargo_is_needed_only_to_build() {
    let run = Run::finished();
    let bin = run.tree.path().join("bin");
    only(&bin, &NEEDED);
    let set = format!("SET={TINY}");
    let output = command(run.tree.path(), &["all", &set]).env("PATH", &bin).output().expect("make runs");
    assert!(output.status.success(), "{}", text(&output.stderr));
    fs::remove_file(run.tree.path().join("target/release/hilt")).expect("removed");
    let output = command(run.tree.path(), &["all", &set]).env("PATH", &bin).output().expect("make runs");
    assert!(!output.status.success() && text(&output.stderr).contains("install Rust from https://rustup.rs"));
}

#[test]
fn a_binary_that_cargo_builds_elsewhere_is_found() {
    let run = Run::finished();
    let (bin, elsewhere) = (run.tree.path().join("bin"), run.tree.path().join("else where/x86/release"));
    let (built, place) = (elsewhere.join("hilt"), run.tree.path().join("target/release/hilt"));
    fs::create_dir_all(&elsewhere).expect("made");
    fs::rename(&place, &built).expect("moved");
    only(&bin, &NEEDED);
    let says = format!(r#"{{"reason":"compiler-artifact","executable":"{}","fresh":true}}"#, built.display());
    program(&bin, "cargo", &format!("echo '{says}'; echo x >> calls"));
    let all = |also: &[(&str, &str)]| {
        command(run.tree.path(), &["all", &format!("SET={TINY}")])
            .env("PATH", &bin)
            .envs(also.iter().copied())
            .output()
            .expect("make runs")
    };
    for _ in 0..2 {
        let output = all(&[]);
        assert!(output.status.success(), "{}", text(&output.stderr));
    }
    assert_eq!(fs::read_link(&place).expect("a link"), built);
    assert_eq!(fs::read_to_string(run.tree.path().join("calls")).expect("calls"), "x\n", "cargo is called once");
    // Named by the environment: there, or linked to where make can name it.
    for (name, value, there) in
        [("CARGO_TARGET_DIR", "t1", "t1/release/hilt"), ("CARGO_BUILD_TARGET_DIR", "t2", "t2/release/hilt")]
    {
        assert!(all(&[(name, value)]).status.success());
        assert!(run.tree.path().join(there).exists());
    }
    assert!(all(&[("CARGO_TARGET_DIR", "else where")]).status.success());
}

#[test]
fn a_build_that_leaves_nothing_leaves_no_empty_binary() {
    let run = Run::finished();
    let (bin, place) = (run.tree.path().join("bin"), run.tree.path().join("target/release/hilt"));
    only(&bin, &NEEDED);
    program(&bin, "cargo", ":");
    for empty in [false, true] {
        fs::remove_file(&place).expect("removed");
        if empty {
            fs::write(&place, "").expect("written");
        }
        let output = command(run.tree.path(), &["all"]).env("PATH", &bin).output().expect("make runs");
        let stderr = text(&output.stderr);
        assert!(!output.status.success() && stderr.contains("has left no target/release/hilt"), "{stderr}");
        fs::write(&place, "").expect("written");
    }
}

#[test]
fn help_needs_no_column() {
    let run = Run::finished();
    let bin = run.tree.path().join("bin");
    only(&bin, &["make", "awk", "bash", "nproc"]);
    let output = command(run.tree.path(), &["help"]).env("PATH", &bin).output().expect("make runs");
    let said = text(&output.stdout);
    assert!(output.status.success() && said.contains("\n  clean-runs   remove what was made"), "{said}{}", text(&output.stderr));
}
