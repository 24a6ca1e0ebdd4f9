use super::common::{SettingsArgs, path_or, same_task};
use super::epochs::Epochs;
use super::{Context, Outcome, pretrain};
use crate::config::Stage;
use crate::data::{atomic, table_file, weights};
use crate::error::{Error, Result};
use crate::learn::{Dynamics, EpochMetrics, Method, train};
use crate::tasks::Task;
use std::path::{Path, PathBuf};

/// Kind of the weights that this stage writes.
pub const KIND: &str = "policy";

/// Learn the policy: hybrid imitation learning (Algorithm 1), behavior cloning (2) or state cloning (3).
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    settings: SettingsArgs,
    /// Method: hil, bc or sc
    #[arg(long, value_name = "METHOD", default_value = "hil", value_parser = method)]
    method: Method,
    /// State recovery probability, 0 to 1 [default: train.rho]
    #[arg(long, value_name = "RHO", allow_negative_numbers = true)]
    rho: Option<f64>,
    /// Weight of state cloning: adaptive, or 0 to 1 [default: train.alpha]
    #[arg(long, value_name = "ALPHA", allow_negative_numbers = true)]
    alpha: Option<String>,
    /// Directory with the datasets train and validation [default: runs/<TASK>/dataset]
    #[arg(long, value_name = "DIR")]
    dataset: Option<PathBuf>,
    /// Weights of the dynamics network; bc needs none [default: runs/<TASK>/dynamics.safetensors]
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
    let (demos, validation) = pretrain::demos(&dir, pipeline.task)?;
    let needs_model = args.method != Method::Bc || args.dynamics.is_some();
    let dynamics = needs_model.then(|| read_dynamics(&model, pipeline.task)).transpose()?;
    let all = [("dataset", dir.as_path()), ("dynamics", model.as_path())];
    let inputs = if needs_model { &all[..] } else { &all[..1] };
    let mut provenance = args.settings.provenance(Stage::Train, &pipeline, inputs)?;
    [&metrics, &out].into_iter().try_for_each(|path| atomic::check_place(path))?;
    provenance.settings["method"] = format!("{:?}", args.method).to_lowercase().into();

    let mut epochs = Epochs::new(&context.console);
    let seed = args.settings.seed;
    let mut log = |epoch: &EpochMetrics| epochs.step(epoch);
    let trained = train(args.method, &demos, &validation, dynamics, &pipeline.train, seed, &mut log, &context.interrupt)?;
    epochs.finish();
    let weights = weights::encode(&out, KIND, &trained.policy.to_tensors(), &trained.policy.meta(), &provenance)?;
    let table = table_file::encode(&metrics, &trained.metrics, &provenance)?;
    atomic::write_all(&[(metrics, table), (out.clone(), weights)])?;
    context.console.say(&format!("train: wrote {}", out.display()));
    Ok(Outcome::Done)
}

fn read_dynamics(path: &Path, task: Task) -> Result<Dynamics> {
    let (tensors, meta, made) = weights::read(path, pretrain::KIND)?;
    same_task(path, made.task, task)?;
    Dynamics::from_tensors(&tensors, &meta).map_err(|why| Error::input(path, why))
}

fn method(name: &str) -> std::result::Result<Method, String> {
    match name {
        "hil" => Ok(Method::Hil),
        "bc" => Ok(Method::Bc),
        "sc" => Ok(Method::Sc),
        _ => Err(format!("unknown method \"{name}\"; allowed: hil (both losses), bc (behavior cloning), sc (state cloning)")),
    }
}
