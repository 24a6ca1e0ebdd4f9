use super::common::SettingsArgs;
use super::listen::ListenArgs;
use super::{Context, Outcome};
use crate::error::{Error, Result};
use crate::serve::WorldHost;

/// Serve the simulated task as an environment for programs of others: the episodes of an evaluation, step by step, over a WebSocket.
///
/// python/hilt_gym makes a Gymnasium environment of it. Episode N of seed S is episode N of `hilt evaluate --seed S`; others are there for
/// learning. docs/serve.md describes the protocol.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  hilt serve-env --task stack --port 8001")]
pub struct Args {
    #[command(flatten)]
    settings: SettingsArgs,
    /// Control steps after which an episode is given up, where a client says nothing else [default: evaluate.horizon_steps, or
    /// simulate.max_steps where that is 0]
    #[arg(long, value_name = "N")]
    horizon: Option<u32>,
    #[command(flatten)]
    listen: ListenArgs,
}

/// The largest seed that clients are told of.
const LARGEST_SEED: u64 = i64::MAX as u64;

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    if args.settings.seed > LARGEST_SEED {
        let what =
            format!("--seed {}; allowed: at most {LARGEST_SEED}, as the protocol's whole numbers are signed", args.settings.seed);
        return Err(Error::Usage(what));
    }
    let horizon = ("evaluate.horizon_steps", args.horizon.map(|steps| steps.to_string()));
    let pipeline = args.settings.resolve(&[horizon])?;
    args.settings.places(&context.console).read_all(args.listen.reads()).check(&context.console)?;
    let horizon_steps = match pipeline.evaluate.horizon_steps {
        0 => pipeline.simulate.max_steps,
        given => given,
    };
    args.listen.serve(&WorldHost::new(&pipeline, args.settings.seed, horizon_steps, &context.interrupt), context)
}
