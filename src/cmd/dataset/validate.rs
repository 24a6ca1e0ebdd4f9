use super::common::roots;
use crate::cmd::places::Places;
use crate::cmd::{Context, Outcome, output};
use crate::data::dataset::foreign::problems;
use crate::error::{Error, Result};
use std::path::PathBuf;

/// Name everything that is wrong with a dataset: what LeRobot needs to load it, and what learning needs beyond. Exit code 1 if there is anything.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  hilt dataset validate dataset/train")]
pub struct Args {
    /// A LeRobotDataset v3.0, or a directory with train and validation
    #[arg(value_name = "DIR")]
    dataset: PathBuf,
    /// Print JSON: a list of the problems
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    Places::new().read(&args.dataset).check(&context.console)?;
    let roots = roots(&args.dataset);
    let mut all = Vec::new();
    for root in &roots {
        let prefix = if roots.len() == 1 { String::new() } else { format!("{}: ", root.display()) };
        all.extend(problems(root, &context.interrupt)?.into_iter().map(|what| format!("{prefix}{what}")));
    }
    if args.json {
        output::print_json(&all)?;
    } else {
        all.iter().try_for_each(|what| output::print(&format!("{what}\n")))?;
    }
    match all.len() {
        0 => {
            context.console.say("dataset: nothing is wrong with it");
            Ok(Outcome::Done)
        }
        1 => Err(Error::input(&args.dataset, "has 1 problem")),
        n => Err(Error::input(&args.dataset, format!("has {n} problems"))),
    }
}
