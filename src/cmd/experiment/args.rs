//! The command line of an experiment.

use crate::experiment::seeds_of;
use std::path::PathBuf;

/// Run an experiment: a grid of tasks, presets, variations, methods and seeds as ordinary stages, each once. Stopped, the same command goes on.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  hilt experiment few-demos --dry-run")]
pub struct Args {
    /// Name of an experiment in pipelines/experiments, or a file
    #[arg(value_name = "NAME|FILE.toml")]
    pub name: String,
    /// Directory of its runs and results [default: runs/experiments/NAME]
    #[arg(long, value_name = "DIR")]
    pub dir: Option<PathBuf>,
    /// Seeds instead of the file's: 0-4,9
    #[arg(long, value_name = "SEEDS", value_parser = parse_seeds)]
    pub seeds: Option<Chosen>,
    /// Episodes of each evaluation instead of the file's
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u64).range(1..))]
    pub episodes: Option<u64>,
    /// Steps side by side, among which the threads are divided [default: one for each two threads]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: Option<u16>,
    #[command(flatten)]
    pub instead: Instead,
    /// File for --emit [default: Snakefile, or submit.sh, in the experiment's directory]
    #[arg(long, value_name = "FILE", requires = "emit")]
    pub out: Option<PathBuf>,
}

/// What is done instead of running.
#[derive(Debug, clap::Args)]
#[group(multiple = false)]
pub struct Instead {
    /// Print the steps, which are done, and an estimate of time
    #[arg(long)]
    pub dry_run: bool,
    /// Print the steps for scripts
    #[arg(long, value_name = "FORMAT")]
    pub list: Option<ListFormat>,
    /// Write the steps as a workflow for another program
    #[arg(long, value_name = "PROGRAM")]
    pub emit: Option<Program>,
    /// Write the results of what is finished, run nothing
    #[arg(long)]
    pub collect: bool,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub enum ListFormat {
    Json,
}

/// Who runs a workflow.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub enum Program {
    Snakemake,
    Slurm,
}

/// Seeds of the command line. Not a bare list: that would be a flag given several times.
#[derive(Clone, Debug)]
pub struct Chosen(pub Vec<u64>);

/// `0-4,9` as seeds.
pub fn parse_seeds(text: &str) -> std::result::Result<Chosen, String> {
    seeds_of(text).map(Chosen)
}
