use super::common::open;
use crate::cmd::places::{Content, EDITED, Places};
use crate::cmd::{Context, Outcome};
use crate::data::dataset::edit::{self, Part, Plan};
use crate::data::dataset::{TRAIN, VALIDATION, split};
use crate::error::{Error, Result};
use serde_json::json;
use std::path::PathBuf;

/// Split a dataset by episode into the datasets train and validation, each with its own statistics.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  hilt dataset split dataset/train --ratio 5 --out parts")]
pub struct Args {
    /// A LeRobotDataset v3.0
    #[arg(value_name = "DIR")]
    dataset: PathBuf,
    /// Directory to write, with train and validation in it
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Training episodes per validation episode
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    ratio: u32,
    /// Seed of the choice
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    Places::new().read(&args.dataset).write("--out", &args.out, Content::Datasets(EDITED)).check(&context.console)?;
    let input = open(&args.dataset)?;
    let count = input.episodes();
    if count < 2 {
        return Err(Error::input(&args.dataset, "has one episode; two are needed, one for each part"));
    }
    let (_, validation) = split(count, args.ratio, args.seed);
    let held_out: Vec<bool> = (0..count).map(|number| validation.binary_search(&number).is_ok()).collect();
    let parts = [
        Part { folder: TRAIN, takes: vec![held_out.iter().map(|held_out| !held_out).collect()] },
        Part { folder: VALIDATION, takes: vec![held_out] },
    ];
    let said = json!({ "operation": "split", "train_per_validation": args.ratio });
    let plan = Plan { said, seed: args.seed, dropped: Vec::new(), normalise: false };
    edit::write(&args.out, &[input], &plan, &parts, &context.interrupt)?;
    let (out, v) = (args.out.display(), validation.len());
    context.console.say(&format!("dataset: wrote {out}: {} training and {v} validation episodes", count - v));
    Ok(Outcome::Done)
}
