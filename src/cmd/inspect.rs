use super::places::Places;
use super::{Context, Outcome, output};
use crate::data;
use crate::error::Result;
use std::path::PathBuf;

/// Say what a file or directory of hilt is: provenance, shapes, counts, statistics.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Plans, recording, directory of recordings, dataset, weights, metrics or evaluation
    #[arg(value_name = "FILE|DIR")]
    path: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    Places::new().read(&args.path).check(&context.console)?;
    let found = data::inspect(&args.path, &context.interrupt)?;
    if args.json {
        output::print_json(&found)?;
    } else {
        output::print(&data::inspect_text(&found))?;
    }
    Ok(Outcome::Done)
}
