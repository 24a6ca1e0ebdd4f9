use super::common::{check_places, open};
use crate::cmd::{Context, Outcome};
use crate::data::dataset::edit::{self, Part, Plan};
use crate::error::{Error, Result};
use serde_json::json;
use std::path::PathBuf;

/// Put the episodes of several datasets with the same columns into one, renumbered.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  hilt dataset merge dataset/train dataset/validation --out all")]
pub struct Args {
    /// LeRobotDatasets v3.0, two or more
    #[arg(value_name = "DIR", required = true, num_args = 2..)]
    datasets: Vec<PathBuf>,
    /// Directory to write
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    check_places(&args.datasets, &args.out, context)?;
    let inputs = args.datasets.iter().map(|dir| open(dir)).collect::<Result<Vec<_>>>()?;
    if let Some((one, other)) = edit::same_twice(&inputs) {
        let message = format!("is the same dataset as {}; its episodes would be there twice", args.datasets[one].display());
        return Err(Error::input(&args.datasets[other], message));
    }
    let takes = inputs.iter().map(|input| vec![true; input.episodes()]).collect();
    let all: usize = inputs.iter().map(edit::Input::episodes).sum();
    let plan = Plan { said: json!({ "operation": "merge" }), seed: 0, dropped: Vec::new(), normalise: false };
    edit::write(&args.out, &inputs, &plan, &[Part { folder: "", takes }], &context.interrupt)?;
    let (out, n) = (args.out.display(), inputs.len());
    context.console.say(&format!("dataset: wrote {out}: {all} episodes of {n} datasets"));
    Ok(Outcome::Done)
}
