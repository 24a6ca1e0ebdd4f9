use super::places::{Content, Places, beside};
use super::{Context, Outcome, output, train};
use crate::data::{atomic, csv, onnx, tensorboard, weights};
use crate::error::{Error, Result};
use crate::export;
use crate::learn::Policy;
use crate::report::curves::sources;
use crate::tasks::with_layout;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// Write what hilt has made for programs that are not hilt.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    format: Format,
}

#[derive(Debug, clap::Subcommand)]
enum Format {
    #[command(long_flag = "onnx")]
    Onnx(OnnxArgs),
    Csv(CsvArgs),
    Tensorboard(TensorboardArgs),
}

/// A policy as ONNX, for any runtime: from the raw state row to the mean action, features and normalisation inside the graph.
///
/// The input `state` [batch, entries of a state] and the output `action` [batch, entries of an action] are single precision in the units
/// of the policy's layout; the file's metadata name every entry, the control period and where the policy comes from. See
/// docs/run-a-policy.md.
#[derive(Debug, clap::Args)]
struct OnnxArgs {
    /// Weights of a policy
    #[arg(value_name = "POLICY.safetensors")]
    policy: PathBuf,
    /// File to write [default: beside the policy, its name with .onnx]
    #[arg(long, value_name = "FILE.onnx")]
    out: Option<PathBuf>,
}

/// A table, a recording or a dataset as CSV: a row a row, a step or a frame; the first line names the columns with their units.
///
/// Example: hilt export csv runs/stack/evaluation.episodes.parquet > episodes.csv
#[derive(Debug, clap::Args)]
struct CsvArgs {
    /// Table (plans, metrics, episodes), recording, or dataset (runs/stack/dataset/train)
    #[arg(value_name = "FILE.parquet|FILE.mcap|DIR")]
    of: PathBuf,
    /// File to write [default: standard output]
    #[arg(long, value_name = "FILE.csv")]
    out: Option<PathBuf>,
}

/// Metrics of trainings as event files of TensorBoard's: tensorboard --logdir DIR shows them.
///
/// A step is an epoch, counted over all stages. The same metrics give the same bytes: where an event has a time it has the step.
///
/// Example: hilt export tensorboard runs/stack --out board
#[derive(Debug, clap::Args)]
struct TensorboardArgs {
    /// Runs, or tables of metrics (policy.training.parquet, dynamics.pretraining.parquet)
    #[arg(value_name = "RUN|FILE.parquet", required = true)]
    of: Vec<PathBuf>,
    /// Directory to write: one in it for each table
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    match &args.format {
        Format::Onnx(args) => to_onnx(args, context),
        Format::Csv(args) => to_csv(args, context),
        Format::Tensorboard(args) => to_tensorboard(args, context),
    }
}

/// Whether all goes to stdout.
pub fn only_answers(args: &Args) -> bool {
    matches!(&args.format, Format::Csv(args) if args.out.is_none())
}

fn to_csv(args: &CsvArgs, context: &Context) -> Result<Outcome> {
    let places = args.out.iter().fold(Places::new().read(&args.of), |places, out| places.write("--out", out, Content::Csv));
    places.check(&context.console)?;
    match &args.out {
        Some(out) => {
            atomic::write_with(out, |file| csv::write(&args.of, out, &mut BufWriter::new(file)))?;
            context.console.say(&format!("export: wrote {}", out.display()));
        }
        None => output::stream(|out| csv::write(&args.of, Path::new(output::NAME), out))?,
    }
    Ok(Outcome::Done)
}

fn to_tensorboard(args: &TensorboardArgs, context: &Context) -> Result<Outcome> {
    // The events may stand in the run that they are of.
    let read = args.of.iter().map(PathBuf::as_path).filter(|path| !path.is_dir());
    Places::new().read_all(read).write("--out", &args.out, Content::Events).check(&context.console)?;
    let sources = sources(&args.of, &context.interrupt)?;
    atomic::write_dir(&args.out, tensorboard::is_file, |dir| {
        sources
            .iter()
            .try_for_each(|source| atomic::write_new(&dir.join(source.place()).join(tensorboard::FILE), &source.events()))
    })?;
    context.console.say(&format!("export: wrote {}: tensorboard --logdir shows it", args.out.display()));
    Ok(Outcome::Done)
}

fn to_onnx(args: &OnnxArgs, context: &Context) -> Result<Outcome> {
    let out = args.out.clone().unwrap_or_else(|| beside(&args.policy, "onnx"));
    Places::new().read(&args.policy).write("--out", &out, Content::Onnx).check(&context.console)?;
    let (tensors, description, made, content) = weights::read_hashed(&args.policy, train::KIND)?;
    let policy = Policy::from_tensors(&tensors, &with_layout(description)).map_err(|why| Error::input(&args.policy, why))?;
    atomic::write_bytes(&out, &export::onnx::encode(&policy, &made, &content))?;
    context.console.say(&format!("export: wrote {}, operators of opset {}", out.display(), onnx::OPSET));
    Ok(Outcome::Done)
}
