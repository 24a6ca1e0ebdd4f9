//! The studies: success rates of many trainings, as commands that can be stopped and started again.
//!
//! ```text
//! cargo bench --bench study -- few-demos     # BC, SC and HIL with 10 to 100 demos: docs/results/few-demos.csv
//! cargo bench --bench study -- off-track     # BC and HIL in scenes that their demos do not show, and with demos that do
//! cargo bench --bench study -- paper         # preset paper, three tasks
//! cargo bench --bench study -- gradients --recordings DIR --dynamics FILE   # the network's answer to an action beside the simulator's
//! cargo bench --bench study -- simulator     # accuracy and speed of the contact physics under other settings
//! cargo bench --bench study -- replay --recordings DIR   # control steps per second of the physics alone
//! cargo bench --bench study -- figure        # docs/pictures/few-demos.svg from the CSV
//! cargo bench --bench study -- table         # the CSV as a markdown table; --csv names another
//! ```

mod chain;
mod few_demos;
mod gradients;
mod lab;
mod off_track;
mod paper;
mod replay;
mod results;
mod show;
mod simulator;
mod trials;

use clap::{Parser, ValueEnum};
use std::path::PathBuf;

/// Run a study stage by stage. What exists already, made with the same settings, is not made again.
#[derive(Clone, Debug, Parser)]
pub struct Args {
    /// Which study, or what to make of its results
    study: Option<Study>,
    /// Override a setting in every stage; may be repeated
    #[arg(long, value_name = "STAGE.KEY=VALUE")]
    set: Vec<String>,
    /// Override a setting in the pretraining and in the training of hil alone; may be repeated
    #[arg(long, value_name = "STAGE.KEY=VALUE")]
    hil_set: Vec<String>,
    /// Seeds of demos, training and evaluation [default: 101 to 105; off-track and paper: 0 to 2]
    #[arg(long, value_delimiter = ',')]
    seeds: Vec<u64>,
    /// few-demos: numbers of demos
    #[arg(long, value_delimiter = ',', default_values_t = [10, 25, 50, 100])]
    demos: Vec<u64>,
    /// few-demos: what the policy sees: best (as the settings say), masked (without joint velocities), raw (the state itself)
    #[arg(long, value_delimiter = ',', default_values = ["best", "masked", "raw"])]
    features: Vec<few_demos::Features>,
    /// Methods: bc, sc, hil [default: all; off-track: bc and hil; paper: hil]
    #[arg(long, value_delimiter = ',')]
    methods: Vec<chain::Method>,
    /// Names of off-track pipelines, or of settings of the simulator [default: all]
    #[arg(long, value_delimiter = ',')]
    variations: Vec<String>,
    /// Unseen episodes of each evaluation; simulator: episodes of a cell, at most 100
    #[arg(long, default_value_t = 500)]
    episodes: u64,
    /// few-demos, off-track: the ordinary pipeline
    #[arg(long, value_name = "FILE", default_value = "pipelines/stack.toml")]
    pipeline: PathBuf,
    /// Runs side by side
    #[arg(long, default_value_t = 2)]
    jobs: usize,
    /// Threads of each run; the compared times are processor time and fair with one
    #[arg(long, default_value_t = 1)]
    threads: usize,
    /// Where the runs go
    #[arg(long, value_name = "DIR", default_value = "target/study")]
    dir: PathBuf,
    /// Results [default: docs/results/STUDY.csv]
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// figure: the picture
    #[arg(long, value_name = "FILE", default_value = "docs/pictures/few-demos.svg")]
    picture: PathBuf,
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
    FewDemos,
    OffTrack,
    Paper,
    Gradients,
    Simulator,
    Replay,
    Figure,
    Table,
}

impl Args {
    /// The results file of a study.
    fn csv_of(&self, study: &str) -> PathBuf {
        self.csv.clone().unwrap_or_else(|| PathBuf::from(format!("docs/results/{study}.csv")))
    }

    /// The given seeds, or these.
    fn seeds_or(&self, default: impl IntoIterator<Item = u64>) -> Vec<u64> {
        if self.seeds.is_empty() { default.into_iter().collect() } else { self.seeds.clone() }
    }

    /// The given methods, or these.
    fn methods_or(&self, default: &[chain::Method]) -> Vec<chain::Method> {
        if self.methods.is_empty() { default.to_vec() } else { self.methods.clone() }
    }
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    match args.study {
        Some(Study::FewDemos) => few_demos::run(&args),
        Some(Study::OffTrack) => off_track::run(&args),
        Some(Study::Paper) => paper::run(&args),
        Some(Study::Gradients) => gradients::run(&args),
        Some(Study::Simulator) => simulator::run(&args),
        Some(Study::Replay) => replay::run(&args),
        Some(Study::Figure) => show::figure(&args),
        Some(Study::Table) => show::table(&args),
        // `cargo bench` runs every bench: hours of training are not started by accident.
        None => {
            println!(
                "study: name one: cargo bench --bench study -- few-demos|off-track|paper|gradients|simulator|replay|figure|table"
            );
            Ok(())
        }
    }
}
