use super::common::{Ends, named, write};
use crate::cmd::{Context, Outcome};
use crate::data::dataset::edit::{self, Plan};
use crate::error::{Error, Result};
use crate::words::did_you_mean;
use serde_json::json;

/// Leave out columns or episodes of a dataset.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  hilt dataset drop dataset/train --episodes 0,2 --out fewer")]
pub struct Args {
    #[command(flatten)]
    ends: Ends,
    /// Columns to leave out
    #[arg(long, value_name = "COLUMN,...", value_delimiter = ',')]
    columns: Vec<String>,
    /// Episodes to leave out, by number: 0-9,12
    #[arg(long, value_name = "LIST")]
    episodes: Option<String>,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    if args.columns.is_empty() && args.episodes.is_none() {
        return Err(Error::Usage("what is to be dropped? give --columns or --episodes".into()));
    }
    let input = args.ends.open(context)?;
    for name in &args.columns {
        if edit::is_usual(name) {
            return Err(Error::Usage(format!("--columns {name}: every dataset has this column; it cannot be left out")));
        }
        if !input.columns().any(|column| column == name) {
            let (hint, all) = (did_you_mean(name, input.columns()), input.columns().collect::<Vec<_>>().join(", "));
            return Err(Error::Usage(format!("--columns {name}: there is no such column{hint} (columns: {all})")));
        }
    }
    let takes = match &args.episodes {
        Some(list) => named("--episodes", list, &input)?.into_iter().map(|dropped| !dropped).collect(),
        None => vec![true; input.episodes()],
    };
    let said = json!({ "operation": "drop", "columns": args.columns, "episodes": args.episodes });
    write(&args.ends.out, input, &Plan { said, seed: 0, dropped: args.columns.clone(), normalise: false }, takes, context)
}
