use super::places::Places;
use super::{Context, Outcome, output};
use crate::error::Result;
use crate::report::runs::{list, list_json, list_text};
use std::path::PathBuf;

/// List the runs below a directory: success, method, demos, time, and the settings in which they differ, the best of each task first.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  hilt runs .")]
pub struct Args {
    /// Directory with runs in it, at any depth: runs, runs/experiments/table3
    #[arg(value_name = "DIR", default_value = super::common::RUNS)]
    dir: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    Places::new().read(&args.dir).check(&context.console)?;
    let rows = list(&args.dir, &context.interrupt)?;
    if args.json {
        output::print_json(&list_json(&rows))?;
    } else {
        output::print(&list_text(&rows, output::width()))?;
    }
    Ok(Outcome::Done)
}
