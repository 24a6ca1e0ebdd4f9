//! Compiles the files of `proto` in Rust alone: message types for the library, and the schema that recordings carry.

use prost::Message;
use std::error::Error;
use std::path::Path;
use std::process::Command;

fn main() -> Result<(), Box<dyn Error>> {
    // What the binary is built of; nothing else, so that a commit alone builds nothing anew.
    ["proto", "src", "pipelines", "Cargo.toml", "Cargo.lock"].iter().for_each(|path| println!("cargo::rerun-if-changed={path}"));
    if let Some(commit) = commit() {
        println!("cargo::rustc-env=HILT_COMMIT={commit}");
    }
    let out = std::env::var("OUT_DIR")?;
    let mut descriptors = protox::compile(["hilt.proto"], ["proto"])?;
    prost_build::Config::new().compile_fds(descriptors.clone())?;
    for of_others in ["onnx.proto", "tensorboard.proto"] {
        prost_build::Config::new().compile_fds(protox::compile([of_others], ["proto"])?)?;
    }
    // Readers need the types, not the comments.
    descriptors.file.iter_mut().for_each(|file| file.source_code_info = None);
    std::fs::write(Path::new(&out).join("hilt.descriptors"), descriptors.encode_to_vec())?;
    Ok(())
}

/// The commit that is built, with "-dirty" where files differ from it; `None` outside of its repository (a tarball) and without git.
fn commit() -> Option<String> {
    let root = std::env::var("CARGO_MANIFEST_DIR").ok()?;
    let git = |words: &[&str]| {
        let output = Command::new("git").args(words).current_dir(&root).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_string())
    };
    // A tarball may lie in a repository of another program.
    let top = git(&["rev-parse", "--show-toplevel"])?;
    let same = Path::new(&top).canonicalize().ok()? == Path::new(&root).canonicalize().ok()?;
    if same { git(&["describe", "--always", "--dirty", "--exclude", "*"]) } else { None }
}
