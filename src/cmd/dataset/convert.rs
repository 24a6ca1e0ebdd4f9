use super::common::{check_places, open, write};
use crate::cmd::{Context, Outcome};
use crate::data::dataset::edit::Plan;
use crate::error::Result;
use serde_json::json;
use std::path::PathBuf;

/// Write a dataset anew as LeRobot writes it: float32 for float64, exact timestamps, plain files, all statistics.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A LeRobotDataset v3.0
    #[arg(value_name = "DIR")]
    dataset: PathBuf,
    /// Directory to write
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    check_places(std::slice::from_ref(&args.dataset), &args.out, context)?;
    let input = open(&args.dataset)?;
    let takes = vec![true; input.episodes()];
    let plan = Plan { said: json!({ "operation": "convert" }), seed: 0, dropped: Vec::new(), normalise: true };
    write(&args.out, input, &plan, takes, context)
}
