//! An experiment for others to run: the same commands as a workflow of Snakemake, as job arrays of Slurm, or as a list for scripts.

mod slurm;
mod snakemake;

pub use slurm::slurm;
pub use snakemake::snakemake;

use super::runs::Grid;
use super::state::State;
use serde_json::{Value, json};
use std::path::Path;

/// What stands in a file that was emitted, so that it may be replaced.
pub const MARK: &str = "Made by hilt experiment";

/// What a workflow needs to know beside the steps.
#[derive(Clone, Copy, Debug)]
pub struct Site<'a> {
    /// The binary.
    pub hilt: &'a str,
    /// The experiment's name.
    pub name: &'a str,
    /// The experiment's directory.
    pub dir: &'a Path,
    /// The arguments that collect its results.
    pub collect: &'a [String],
    /// Threads of a step.
    pub threads: usize,
}

/// The steps for scripts.
pub fn list(grid: &Grid, states: &[State], threads: usize) -> Value {
    let threads = threads.to_string();
    let steps = grid.steps.iter().zip(states).map(|(step, state)| {
        let argv: Vec<String> = [String::from("hilt")].into_iter().chain(step.command(&threads)).collect();
        json!({
            "id": step.id,
            "stage": step.stage.name(),
            "task": step.task,
            "seed": step.seed,
            "command": argv,
            "inputs": step.inputs.iter().map(|input| &input.path).collect::<Vec<_>>(),
            "outputs": step.outputs.iter().map(|output| &output.path).collect::<Vec<_>>(),
            "log": step.log,
            "state": state.name(),
        })
    });
    steps.collect()
}

/// Words as one line for a shell.
fn line(words: &[String]) -> String {
    words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let plain = |b: u8| b.is_ascii_alphanumeric() || b"-_./=,:+@%".contains(&b);
    if !word.is_empty() && word.bytes().all(plain) { word.into() } else { format!("'{}'", word.replace('\'', r"'\''")) }
}
