//! `hilt export onnx` from outside: what it writes, and that nothing is lost when it refuses.

use assert_cmd::Command;
use std::fs;
use std::path::{Path, PathBuf};

fn fixture() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/pick-up/policy.safetensors")
}

/// Exit code and stderr.
fn export(words: &[&Path]) -> (Option<i32>, String) {
    let output = Command::cargo_bin("hilt").expect("built").arg("export").args(words).output().expect("runs");
    assert!(output.stdout.is_empty(), "data go to the file");
    (output.status.code(), String::from_utf8(output.stderr).expect("UTF-8"))
}

/// The names in a directory.
fn names(dir: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(dir).expect("readable").map(|e| e.expect("entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn it_writes_beside_the_policy_or_where_it_is_told_and_again_the_same() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let at = |name: &str| dir.path().join(name);
    fs::copy(fixture(), at("policy.safetensors")).expect("copied");
    let done = export(&[Path::new("onnx"), &at("policy.safetensors")]);
    assert_eq!(done.0, Some(0), "{}", done.1);
    let first = fs::read(at("policy.onnx")).expect("written");
    let flags = [Path::new("--onnx"), &at("policy.safetensors"), Path::new("--out"), &at("other.onnx")];
    assert_eq!(export(&flags).0, Some(0));
    assert_eq!(fs::read(at("other.onnx")).expect("written"), first);
    // its own place is free, also where an earlier one was cut short
    fs::write(at("other.onnx"), &first[..first.len() / 2]).expect("written");
    assert_eq!(export(&flags).0, Some(0));
    assert_eq!(fs::read(at("other.onnx")).expect("written"), first);
    assert_eq!(names(dir.path()), ["other.onnx", "policy.onnx", "policy.safetensors"]);
}

#[test]
fn what_is_no_policy_is_refused_and_nothing_is_written() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let at = |name: &str| dir.path().join(name);
    let whole = fs::read(fixture()).expect("a policy");
    fs::write(at("noise.safetensors"), "no network").expect("written");
    fs::write(at("cut.safetensors"), &whole[..whole.len() - 100]).expect("written");
    let mut changed = whole.clone();
    *changed.last_mut().expect("not empty") ^= 1;
    fs::write(at("changed.safetensors"), changed).expect("written");
    let (tensors, meta, made) = hilt::data::weights::read(&fixture(), "policy").expect("a policy");
    hilt::data::weights::write(&at("dynamics.safetensors"), "dynamics", &tensors, &meta, &made).expect("written");
    hilt::data::weights::write(&at("hollow.safetensors"), "policy", &tensors[1..], &meta, &made).expect("written");
    let before = names(dir.path());
    for (name, said) in [
        ("noise.safetensors", "is no safetensors file"),
        ("cut.safetensors", "seal"),
        ("changed.safetensors", "changed"),
        ("dynamics.safetensors", "holds the weights of a dynamics network, a policy network is needed"),
        ("hollow.safetensors", "policy.state.mean is missing"),
        ("missing.safetensors", "cannot read"),
    ] {
        let (code, stderr) = export(&[Path::new("onnx"), &at(name), Path::new("--out"), &at("out.onnx")]);
        assert_eq!(code, Some(1), "{name}: {stderr}");
        assert!(stderr.contains(said) && stderr.contains(name), "{name}: {stderr}");
        assert_eq!(names(dir.path()), before);
    }
}

#[test]
fn a_place_that_is_not_its_own_is_refused() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let at = |name: &str| dir.path().join(name);
    // as PyTorch begins its files
    let foreign = [&[0x08, 0x07, 0x12, 0x07][..], b"pytorch", &[0x1a, 0x03], b"2.0"].concat();
    fs::write(at("foreign.onnx"), &foreign).expect("written");
    // one that was cut short is not ours to replace either
    fs::write(at("cut.onnx"), &foreign[..6]).expect("written");
    fs::write(at("notes.onnx"), "years of work").expect("written");
    fs::create_dir(at("directory.onnx")).expect("made");
    let policy = fs::read(fixture()).expect("a policy");
    fs::write(at("policy.safetensors"), &policy).expect("written");
    std::os::unix::fs::symlink("policy.safetensors", at("link.onnx")).expect("linked");
    let before = names(dir.path());
    for (name, code, said) in [
        ("foreign.onnx", 2, "holds a file that hilt did not write, which would be lost"),
        ("cut.onnx", 2, "holds a file that hilt did not write, which would be lost"),
        ("notes.onnx", 2, "holds a file of another format, which would be lost"),
        ("policy.bin", 2, "its name must end in .onnx: "),
        ("policy.safetensors", 2, "its name must end in .onnx: "),
        ("link.onnx", 2, "which this command reads"),
        ("directory.onnx", 1, "is a directory"),
    ] {
        let (found, stderr) = export(&[Path::new("onnx"), &at("policy.safetensors"), Path::new("--out"), &at(name)]);
        assert_eq!(found, Some(code), "{name}: {stderr}");
        assert!(stderr.contains(said), "{name}: {stderr}");
    }
    assert_eq!(names(dir.path()), before);
    assert_eq!(fs::read(at("foreign.onnx")).expect("there"), foreign);
    assert_eq!(fs::read(at("notes.onnx")).expect("there"), b"years of work");
    assert_eq!(fs::read(at("policy.safetensors")).expect("there"), policy);
}
