use super::common::{SettingsArgs, path_or, same_task};
use super::pretrain::{self, demos};
use super::{Context, Outcome};
use crate::config::Stage;
use crate::data::{table_file, weights};
use crate::error::{Error, Result};
use crate::learn::{self, Dynamics, EpochMetrics, Method};
use std::path::PathBuf;

/// Kind of the weights that this stage writes.
pub const KIND: &str = "policy";

/// Learn the policy: hybrid imitation learning (Algorithm 1), behavior cloning (2) or state cloning (3).
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    settings: SettingsArgs,
    /// Method: hil, bc or sc
    #[arg(long, value_name = "METHOD", default_value = "hil")]
    method: Method,
    /// State recovery probability, 0 to 1 [default: train.rho]
    #[arg(long, value_name = "RHO")]
    rho: Option<f64>,
    /// Weight of state cloning: adaptive, or 0 to 1 [default: train.alpha]
    #[arg(long, value_name = "ALPHA")]
    alpha: Option<String>,
    /// Directory with the datasets train and validation [default: runs/<TASK>/dataset]
    #[arg(long, value_name = "DIR")]
    dataset: Option<PathBuf>,
    /// Weights of the dynamics network [default: runs/<TASK>/dynamics.safetensors]
    #[arg(long, value_name = "FILE.safetensors")]
    dynamics: Option<PathBuf>,
    /// Weights to write [default: runs/<TASK>/policy.safetensors]
    #[arg(long, value_name = "FILE.safetensors")]
    out: Option<PathBuf>,
    /// Metrics per epoch to write [default: training.parquet beside the weights]
    #[arg(long, value_name = "FILE.parquet")]
    metrics: Option<PathBuf>,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    let pipeline =
        args.settings.resolve(&[("train.rho", args.rho.map(|v| v.to_string())), ("train.alpha", args.alpha.clone())])?;
    let dir = path_or(args.dataset.as_deref(), pipeline.task, "dataset");
    let model = path_or(args.dynamics.as_deref(), pipeline.task, "dynamics.safetensors");
    let out = path_or(args.out.as_deref(), pipeline.task, "policy.safetensors");
    let metrics = args.metrics.clone().unwrap_or_else(|| out.with_file_name("training.parquet"));
    let (train, validation) = demos(&dir, pipeline.task)?;
    let (tensors, meta, made) = weights::read(&model, pretrain::KIND)?;
    same_task(&model, made.task, pipeline.task)?;
    let dynamics = Dynamics::from_tensors(&tensors, &meta).map_err(|why| Error::input(&model, why))?;
    let provenance = args.settings.provenance(Stage::Train, &pipeline, &[&dir, &model])?;

    let progress = context.console.progress("train", pipeline.train.epochs, "epochs");
    let seed = args.settings.seed;
    let log = |line: &str| progress.say(line);
    let trained = learn::train(args.method, &train, &validation, dynamics, &pipeline.train, seed, &mut &log, &context.interrupt)?;
    progress.finish("");
    table_file::write(&metrics, &EpochMetrics::to_table(&trained.metrics), &provenance)?;
    weights::write(&out, KIND, &trained.policy.to_tensors(), &trained.policy.meta(), &provenance)?;
    context.console.say(&format!("train: wrote {}", out.display()));
    Ok(Outcome::Done)
}
