use super::common::{Ends, write};
use crate::cmd::{Context, Outcome};
use crate::data::dataset::edit::Plan;
use crate::error::Result;
use serde_json::json;

/// Write a dataset anew as LeRobot writes it: float32 for float64, exact timestamps, plain files, all statistics.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  hilt dataset convert dataset/train --out plain")]
pub struct Args {
    #[command(flatten)]
    ends: Ends,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    let input = args.ends.open(context)?;
    let takes = vec![true; input.episodes()];
    let plan = Plan { said: json!({ "operation": "convert" }), seed: 0, dropped: Vec::new(), normalise: true };
    write(&args.ends.out, input, &plan, takes, context)
}
