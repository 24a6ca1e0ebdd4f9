//! `hilt dataset`: what a LeRobotDataset is, what is wrong with it, and new ones out of it, hilt's own or not.

mod common;
mod convert;
mod drop;
mod filter;
mod info;
mod merge;
mod split;
mod validate;

use super::{Context, Outcome};
use crate::error::Result;

/// Look at, check, split, filter, merge and convert LeRobot datasets, hilt's own or not.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    Info(info::Args),
    Validate(validate::Args),
    Split(split::Args),
    Filter(filter::Args),
    Merge(merge::Args),
    Drop(drop::Args),
    Convert(convert::Args),
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    match &args.command {
        Command::Info(args) => info::run(args, context),
        Command::Validate(args) => validate::run(args, context),
        Command::Split(args) => split::run(args, context),
        Command::Filter(args) => filter::run(args, context),
        Command::Merge(args) => merge::run(args, context),
        Command::Drop(args) => drop::run(args, context),
        Command::Convert(args) => convert::run(args, context),
    }
}

/// Whether a subcommand answers on stdout alone.
pub fn only_answers(args: &Args) -> bool {
    matches!(args.command, Command::Info(_) | Command::Validate(_))
}
