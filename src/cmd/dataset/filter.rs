use super::common::{Ends, named, write};
use crate::cmd::{Context, Outcome};
use crate::data::dataset::edit::Plan;
use crate::error::{Error, Result};
use serde_json::json;

/// Keep some episodes of a dataset: those that meet all of the conditions.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  hilt dataset filter dataset/train --success --min-length 50 --out short")]
pub struct Args {
    #[command(flatten)]
    ends: Ends,
    /// These episodes, by number: 0-9,12
    #[arg(long, value_name = "LIST")]
    episodes: Option<String>,
    /// Episodes of at least so many frames
    #[arg(long, value_name = "FRAMES")]
    min_length: Option<usize>,
    /// Episodes of at most so many frames
    #[arg(long, value_name = "FRAMES")]
    max_length: Option<usize>,
    /// Episodes whose last frame has next.success
    #[arg(long)]
    success: bool,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    if args.episodes.is_none() && args.min_length.is_none() && args.max_length.is_none() && !args.success {
        let message = "which episodes? give --episodes, --min-length, --max-length or --success";
        return Err(Error::Usage(message.into()));
    }
    let input = args.ends.open(context)?;
    let mut takes = match &args.episodes {
        Some(list) => named("--episodes", list, &input)?,
        None => vec![true; input.episodes()],
    };
    let (least, most) = (args.min_length.unwrap_or(0), args.max_length.unwrap_or(usize::MAX));
    takes.iter_mut().zip(input.lengths()).for_each(|(takes, length)| *takes &= (least..=most).contains(&length));
    if args.success {
        let successes = input.successes()?;
        takes.iter_mut().enumerate().for_each(|(number, takes)| *takes &= successes.contains(&number));
    }
    let said = json!({
        "operation": "filter", "episodes": args.episodes, "min_length": args.min_length, "max_length": args.max_length,
        "success": args.success,
    });
    write(&args.ends.out, input, &Plan { said, seed: 0, dropped: Vec::new(), normalise: false }, takes, context)
}
