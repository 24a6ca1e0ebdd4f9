use super::common::roots;
use crate::cmd::places::Places;
use crate::cmd::{Context, Outcome, output};
use crate::data::dataset::foreign::{Root, described};
use crate::data::inspect_text;
use crate::error::Result;
use serde_json::{Map, Value};
use std::path::PathBuf;

/// Say what a dataset is: episodes, frames, rate, columns, tasks, size. It reads the description, not the frames.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  hilt dataset info dataset")]
pub struct Args {
    /// A LeRobotDataset v3.0, or a directory with train and validation
    #[arg(value_name = "DIR")]
    dataset: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    Places::new().read(&args.dataset).check(&context.console)?;
    let roots = roots(&args.dataset);
    let of = |root: &PathBuf| described(&Root::open(root)?);
    let found = match &roots[..] {
        [one] => of(one)?,
        all => {
            let name = |root: &PathBuf| root.file_name().unwrap_or_default().to_string_lossy().into_owned();
            Value::Object(all.iter().map(|root| Ok((name(root), of(root)?))).collect::<Result<Map<_, _>>>()?)
        }
    };
    if args.json {
        output::print_json(&found)?
    } else {
        output::print(&inspect_text(&found))?
    }
    Ok(Outcome::Done)
}
