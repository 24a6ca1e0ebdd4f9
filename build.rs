//! Compiles the files of `proto` in Rust alone: message types for the library, and the schema that recordings carry.

use prost::Message;
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=proto");
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
