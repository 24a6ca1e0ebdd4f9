use super::common::{SettingsArgs, path_or, same_layout, same_task};
use super::epochs::Epochs;
use super::places::{Content, beside};
use super::{Context, Outcome, dropped, output};
use crate::config::{Pipeline, SimulateSettings, Stage};
use crate::data::{ContentHash, atomic, dataset, table_file, weights};
use crate::demo::Demo;
use crate::error::{Error, Result};
use crate::learn::pretrain_dynamics;
use crate::task::FailureClass;
use crate::{seed, sim};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Kind of the weights that this stage writes.
pub const KIND: &str = weights::DYNAMICS;

/// Learn the dynamics network from the demonstrations (Algorithm 4) and report its errors per state group.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    settings: SettingsArgs,
    /// Directory with the datasets train and validation [default: runs/<TASK>/dataset]
    #[arg(long, value_name = "DIR")]
    dataset: Option<PathBuf>,
    /// Weights to write, with <name>.errors.parquet and <name>.pretraining.parquet, their errors and the epochs, beside them [default: runs/<TASK>/dynamics.safetensors]
    #[arg(long, value_name = "FILE.safetensors")]
    out: Option<PathBuf>,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    let pipeline = args.settings.resolve(&[])?;
    let dir = path_or(args.dataset.as_deref(), &pipeline, "dataset");
    let out = path_or(args.out.as_deref(), &pipeline, "dynamics.safetensors");
    let (errors, metrics) = (beside(&out, "errors.parquet"), beside(&out, "pretraining.parquet"));
    let places = args.settings.places().read(&dir).write("--out", &out, Content::Weights(KIND, "pretrain"));
    let places = places.write("the table of errors", &errors, Content::Table("pretrain"));
    places.write("the table of epochs", &metrics, Content::Table("pretrain")).check(&context.console)?;
    let Demos { mut train, validation, content } = demos(&dir, &pipeline)?;
    let provenance = args.settings.provenance(Stage::Pretrain, &pipeline, &[("dataset", content)])?;

    let seed = args.settings.seed;
    let (again, outcome) = reexecute(&train, &pipeline, seed, context)?;
    train.extend(again);
    let mut epochs = Epochs::new(&context.console);
    let (mut log, settings) = (|epoch: &_, metrics| epochs.step(epoch, metrics), &pipeline.pretrain);
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

/// What is learned from, and on what it is judged.
pub struct Demos {
    pub train: Vec<Demo>,
    pub validation: Vec<Demo>,
    /// Of both datasets, as they were read.
    pub content: ContentHash,
}

/// Training and validation demos.
///
/// # Errors
/// What reading returns; [`Error::Input`] when there is no validation demo (a dataset of one episode has none), or when one is a training
/// demo too.
pub fn demos(dir: &Path, pipeline: &Pipeline) -> Result<Demos> {
    let mut files = BTreeMap::new();
    let mut read = |name: &str| -> Result<Vec<Demo>> {
        let found = dataset::read_for(&dir.join(name), &pipeline.task.name)?;
        same_task(&dir.join(name), &found.provenance, pipeline)?;
        same_layout(&dir.join(name), &found.provenance, &found.layout, pipeline)?;
        files.extend(found.files.into_iter().map(|(file, hash)| (format!("{name}/{file}"), hash)));
        Ok(found.demos)
    };
    let train = read(dataset::TRAIN)?;
    let validation = if dir.join(dataset::VALIDATION).exists() { read(dataset::VALIDATION)? } else { Vec::new() };
    if validation.is_empty() {
        let (count, ratio) = (train.len(), pipeline.convert.train_per_validation);
        return Err(Error::input(
            dir,
            format!(
                "training demos: {count}, validation demos: none; `hilt convert` splits {ratio}:1 by episode and needs at least 2 \
                 that succeeded; raise plan.episodes and run plan, simulate and convert again"
            ),
        ));
    }
    if let Some((t, v)) = dataset::first_shared(&train, &validation) {
        let message = format!(
            "training episode {t} is validation episode {v}, in every number: what is validated has been learned; run hilt convert again, \
             over recordings of which none is there twice"
        );
        return Err(Error::input(dir, message));
    }
    let content = ContentHash::of_directory(files.iter().map(|(name, hash)| (name.as_str(), *hash)));
    Ok(Demos { train, validation, content })
}
