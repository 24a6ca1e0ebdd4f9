use super::places::Places;
use super::{Context, Outcome, output, pretrain, train};
use crate::data::{self, weights};
use crate::error::{Error, Result};
use crate::learn::{Dynamics, Policy};
use crate::report::runs::{Run, is_run};
use crate::tasks::with_layout;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Say what a file or directory of hilt is: of a run its success, its stages and what of them is stale; of an artefact provenance, shapes, counts,
/// statistics.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  hilt inspect policy.safetensors\n  hilt inspect recordings --json")]
pub struct Args {
    /// A run (runs/stack), or one of its artefacts: plans, recording, directory of recordings, dataset, weights, metrics, evaluation
    #[arg(value_name = "FILE|DIR")]
    path: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    Places::new().read(&args.path).check(&context.console)?;
    if is_run(&args.path) {
        let run = Run::read(&args.path, &context.interrupt)?;
        if args.json {
            output::print_json(&run.to_json())?
        } else {
            output::print(&run.to_text(output::width()))?
        }
        return Ok(Outcome::Done);
    }
    let found = data::inspect(&args.path, &context.interrupt)?;
    check_network(&args.path, &found["network"])?;
    if args.json {
        output::print_json(&found)?;
    } else {
        output::print(&data::inspect_text(&found))?;
    }
    Ok(Outcome::Done)
}

/// Whether weights are those of a network, as the stages that run it ask.
fn check_network(path: &Path, kind: &Value) -> Result<()> {
    let Some(kind) = kind.as_str().filter(|kind| [train::KIND, pretrain::KIND].contains(kind)) else { return Ok(()) };
    let (tensors, meta, _) = weights::read(path, kind)?;
    let meta = with_layout(meta);
    let made = if kind == train::KIND {
        Policy::from_tensors(&tensors, &meta).map(drop)
    } else {
        Dynamics::from_tensors(&tensors, &meta).map(drop)
    };
    made.map_err(|why| Error::input(path, why))
}
