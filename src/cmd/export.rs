use super::places::{Content, Places, beside};
use super::{Context, Outcome, output, train};
use crate::data::{atomic, csv, marked, onnx, recording, tensorboard, weights};
use crate::error::{Error, Result};
use crate::export;
use crate::learn::Policy;
use crate::report::curves::sources;
use crate::robot::file::{self, built_in};
use crate::robot::urdf;
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
    Urdf(UrdfArgs),
    Csv(CsvArgs),
    Tensorboard(TensorboardArgs),
}

/// A policy as ONNX, for any runtime: from the raw state row to the mean action, features and normalisation inside the graph.
///
/// The input `state` [batch, entries of a state] and the output `action` [batch, entries of an action] are single precision in the units
/// of the policy's layout; the file's metadata name every entry, the control period and where the policy comes from. See
/// docs/run-a-policy.md.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  hilt export onnx policy.safetensors --out policy.onnx")]
struct OnnxArgs {
    /// Weights of a policy
    #[arg(value_name = "POLICY.safetensors")]
    policy: PathBuf,
    /// File to write [default: beside the policy, its name with .onnx]
    #[arg(long, value_name = "FILE.onnx")]
    out: Option<PathBuf>,
}

/// A robot as one URDF without meshes, as hilt computes with it; of a recording the robot and all that stands around it.
///
/// A robot's file has inertia, visual and collision geometry. A recording's is to be looked at: its links are the frames of the recording's
/// /tf. See docs/open-elsewhere.md.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  hilt export urdf panda\n  hilt export urdf recordings/episode-00000.mcap --out scene.urdf")]
struct UrdfArgs {
    /// A robot's TOML file, the name of one that comes with hilt (jaco, panda, ur5e), or a recording
    #[arg(value_name = "NAME|FILE.toml|FILE.mcap")]
    of: PathBuf,
    /// File to write [default: in the working directory, that name with .urdf]
    #[arg(long, value_name = "FILE.urdf")]
    out: Option<PathBuf>,
}

/// A table, a recording or a dataset as CSV: a row a row, a step or a frame; the first line names the columns with their units.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  hilt export csv evaluation.episodes.parquet > episodes.csv")]
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
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  hilt export tensorboard policy.training.parquet --out board")]
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
        Format::Urdf(args) => to_urdf(args, context),
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

fn to_urdf(args: &UrdfArgs, context: &Context) -> Result<Outcome> {
    let ending = args.of.extension().map(|ending| ending.to_ascii_lowercase());
    // Not beside it: a directory of recordings is an artefact of its own.
    let name = || Path::new(args.of.file_name().unwrap_or_default()).with_extension("urdf");
    let out = args.out.clone().unwrap_or_else(name);
    let places = if ending.is_some() { Places::new().read(&args.of) } else { Places::new() };
    places.write("--out", &out, Content::Urdf).check(&context.console)?;
    let document = match ending.as_deref().and_then(|ending| ending.to_str()) {
        None => urdf(&built_in::find(&args.of.display().to_string())?),
        Some("mcap") => recording::scene_urdf(&recording::read(&args.of)?.0.scene),
        Some("toml") => urdf(&file::read(&args.of)?.robot),
        Some(_) => {
            let of = args.of.display();
            return Err(Error::Usage(format!(
                "{of}: a URDF is written of a recording (FILE.mcap) or a robot: its TOML file, or the name of one that comes with hilt"
            )));
        }
    };
    atomic::write_bytes(&out, &marked::urdf(&document))?;
    context.console.say(&format!("export: wrote {}", out.display()));
    Ok(Outcome::Done)
}
