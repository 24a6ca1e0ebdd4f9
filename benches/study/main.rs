//! The studies of single parts: the simulator, and what the dynamics network makes of it. Those of success are experiments (`hilt experiment`).
//!
//! ```text
//! cargo bench --bench study -- gradients --recordings DIR --dynamics FILE   # the network's answer to an action beside the simulator's
//! cargo bench --bench study -- simulator     # accuracy and speed of the contact physics under other settings
//! cargo bench --bench study -- replay --recordings DIR   # control steps per second of the physics alone
//! ```

mod gradients;
mod replay;
mod simulator;
mod trials;

use clap::{Parser, ValueEnum};
use std::path::PathBuf;

/// Look at one part alone.
#[derive(Clone, Debug, Parser)]
pub struct Args {
    /// Which study
    study: Option<Study>,
    /// simulator: names of settings [default: all]
    #[arg(long, value_delimiter = ',')]
    variations: Vec<String>,
    /// simulator: episodes of a cell, at most 100; the others: of the recordings
    #[arg(long, default_value_t = 500)]
    episodes: u64,
    /// gradients, replay: recordings to look at
    #[arg(long, value_name = "DIR")]
    recordings: Option<PathBuf>,
    /// gradients: the dynamics network that learned from them
    #[arg(long, value_name = "FILE")]
    dynamics: Option<PathBuf>,
    /// What cargo adds
    #[arg(long, hide = true)]
    bench: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Study {
    Gradients,
    Simulator,
    Replay,
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    match args.study {
        Some(Study::Gradients) => gradients::run(&args),
        Some(Study::Simulator) => simulator::run(&args),
        Some(Study::Replay) => replay::run(&args),
        // `cargo bench` runs every bench: minutes of physics are not started by accident.
        None => {
            println!("study: name one: cargo bench --bench study -- gradients|simulator|replay");
            Ok(())
        }
    }
}
