use super::places::{Content, Places, beside};
use super::{Context, Outcome, train};
use crate::data::{atomic, onnx, weights};
use crate::error::{Error, Result};
use crate::export;
use crate::learn::Policy;
use crate::tasks::with_layout;
use std::path::PathBuf;

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

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    match &args.format {
        Format::Onnx(args) => to_onnx(args, context),
    }
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
