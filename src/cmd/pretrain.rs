use super::common::SettingsArgs;
use super::epochs::Epochs;
use super::learning::{ColumnArgs, Demos, Learning};
use super::live::{Live, LiveArgs};
use super::places::{Content, beside};
use super::{Context, Outcome, dropped, output};
use crate::config::{Pipeline, SimulateSettings, Stage};
use crate::data::{atomic, table_file, weights};
use crate::demo::Demo;
use crate::error::{Error, Result};
use crate::learn::pretrain_dynamics;
use crate::task::FailureClass;
use crate::{seed, sim};
use rayon::prelude::*;
use std::path::PathBuf;

/// Kind of the weights that this stage writes.
pub const KIND: &str = weights::DYNAMICS;

/// Learn the dynamics network from the demonstrations (Algorithm 4) and report its errors per state group.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  hilt pretrain --dataset dataset --out dynamics.safetensors")]
pub struct Args {
    #[command(flatten)]
    settings: SettingsArgs,
    #[command(flatten)]
    columns: ColumnArgs,
    /// Directory with the datasets train and validation, or any LeRobotDataset v3.0 (without --task) [default: runs/<TASK>/dataset]
    #[arg(long, value_name = "DIR")]
    dataset: Option<PathBuf>,
    /// Weights to write, with <name>.errors.parquet and <name>.pretraining.parquet, their errors and the epochs, beside them [default: runs/<TASK>/dynamics.safetensors]
    #[arg(long, value_name = "FILE.safetensors")]
    out: Option<PathBuf>,
    #[command(flatten)]
    live: LiveArgs,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    let mut learning = Learning::of(&args.settings, &args.columns, args.dataset.as_deref(), &[])?;
    let out = learning.path_or(args.out.as_deref(), "dynamics.safetensors");
    let (errors, metrics) = (beside(&out, "errors.parquet"), beside(&out, "pretraining.parquet"));
    let places =
        args.settings.places(&context.console).read(&learning.dataset).write("--out", &out, Content::Weights(KIND, "pretrain"));
    let places = places.write("the table of errors", &errors, Content::Table("pretrain"));
    let places = places.write("the table of epochs", &metrics, Content::Table("pretrain"));
    args.live.places(places).check(&context.console)?;
    let Demos { mut train, validation, content } = learning.demos(&args.settings, &context.console)?;
    let provenance = learning.provenance(&args.settings, Stage::Pretrain, &[("dataset", content)])?;

    let seed = args.settings.seed;
    let mut outcome = Outcome::Done;
    if let Some(pipeline) = learning.pipeline() {
        let again;
        (again, outcome) = reexecute(&train, pipeline, seed, context)?;
        train.extend(again);
    }
    let mut epochs = Epochs::new(&context.console);
    let mut live = Live::begin("pretrain", &args.live, None, &[], &context.console)?;
    let mut log = |epoch: &_, metrics: &_| {
        epochs.step(epoch, metrics);
        live.step(epoch, metrics);
    };
    let settings = learning.pretrain_settings();
    let (dynamics, report) = pretrain_dynamics(train, validation, settings, seed, &mut log, &context.interrupt)?;
    epochs.finish();
    context.console.say(output::table_text(&report.errors).trim_end());
    let error_table = table_file::encode(&errors, &report.errors, &provenance)?;
    let metric_table = table_file::encode(&metrics, &report.metrics, &provenance)?;
    let weights = weights::encode(&out, KIND, &dynamics.to_tensors(), &dynamics.meta(), &provenance)?;
    atomic::write_all(&[(errors, error_table), (metrics, metric_table), (out.clone(), weights)])?;
    context.console.say(&format!("pretrain: wrote {}", out.display()));
    Ok(outcome)
}

/// For when no command could be executed again.
const ADVICE: &str = "change scene.obstacles, scene.friction or scene.block_mass_kg, or set pretrain.reexecute = 0";

/// The demos' commands executed again in the simulator, `pretrain.reexecute` times each; without those in which it broke down.
fn reexecute(demos: &[Demo], pipeline: &Pipeline, seed: u64, context: &Context) -> Result<(Vec<Demo>, Outcome)> {
    let times = pipeline.pretrain.reexecute;
    if times == 0 {
        return Ok((Vec::new(), Outcome::Done));
    }
    let settings = SimulateSettings { pulses: pipeline.pretrain.reexecute_pulses.clone(), ..pipeline.simulate.clone() };
    let progress = context.console.progress("re-execute", times * demos.len() as u64, "episodes");
    let again = (0..times * demos.len() as u64).into_par_iter().map(|index| {
        context.interrupt.check()?;
        let demo = &demos[(index / times) as usize];
        let rng = seed::stream(seed, "pretrain.reexecute", index);
        let episode = sim::reexecute(
            index,
            (&pipeline.robot, &pipeline.task, demo),
            &pipeline.scene,
            &settings,
            &pipeline.pretrain.reexecute_fingers,
            rng,
            &context.interrupt,
        )?;
        progress.step();
        let what = format!("training demo {}", index / times);
        match episode.failure {
            Some(class @ (FailureClass::SimulationBrokeDown | FailureClass::CommandNotFinite)) => {
                Ok(Err(format!("{what}: {}", class.words())))
            }
            _ => episode.to_demo().map(Ok).map_err(|why| Error::Failed(format!("{what} executed again: {why}"))),
        }
    });
    let again = again.collect::<Result<Vec<dropped::Kept<Demo>>>>()?;
    progress.finish("");
    dropped::keep("re-execute", again, ADVICE, &context.console)
}
