use super::checkpoint::{self, Keeper};
use super::common::SettingsArgs;
use super::epochs::Epochs;
use super::learning::{ColumnArgs, Demos, Learning};
use super::live::{Live, LiveArgs};
use super::places::{Content, beside};
use super::{Console, Context, Outcome};
use crate::config::{Pipeline, Stage};
use crate::data::{ContentHash, atomic, table_file, weights};
use crate::env::Env;
use crate::error::Result;
use crate::eval::{PolicyController, Rollouts};
use crate::interrupt::Interrupt;
use crate::learn::{self, BcRl, Checkpoint, Hooks, Inputs, Method, MethodName, Policy, Ppo, Selection, imitator};
use crate::scene::Scene;
use crate::sim::{Controller, TaskEnv};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// Kind of the weights that this stage writes.
pub const KIND: &str = weights::POLICY;

/// Learn the policy: hybrid imitation learning (Algorithm 1), behavior cloning (2) or state cloning (3) from demos, reinforcement
/// learning in the simulator (ppo), or behavior cloning and then both (bc-rl).
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  hilt train --method hil --dataset dataset --dynamics dynamics.safetensors --out policy.safetensors\n  hilt train --method bc --dataset dataset --out policy-bc.safetensors"
)]
pub struct Args {
    #[command(flatten)]
    settings: SettingsArgs,
    #[command(flatten)]
    columns: ColumnArgs,
    /// Method: hil, bc, sc, ppo or bc-rl
    #[arg(long, value_name = "METHOD", default_value = "hil")]
    method: MethodName,
    /// State recovery probability, 0 to 1 [default: train.rho]
    #[arg(long, value_name = "RHO", allow_negative_numbers = true)]
    rho: Option<f64>,
    /// Weight of state cloning: adaptive, or 0 to 1 [default: train.alpha]
    #[arg(long, value_name = "ALPHA", allow_negative_numbers = true)]
    alpha: Option<String>,
    /// Directory with the datasets train and validation, or any LeRobotDataset v3.0 (without --task); ppo needs none [default: runs/<TASK>/dataset]
    #[arg(long, value_name = "DIR")]
    dataset: Option<PathBuf>,
    /// Weights of the dynamics network; bc, ppo and bc-rl need none [default: runs/<TASK>/dynamics.safetensors]
    #[arg(long, value_name = "FILE.safetensors")]
    dynamics: Option<PathBuf>,
    /// Weights to write [default: runs/<TASK>/policy.safetensors, of another method than hil policy-<METHOD>.safetensors]
    #[arg(long, value_name = "FILE.safetensors")]
    out: Option<PathBuf>,
    /// Metrics per epoch to write [default: beside the weights, their name with .training.parquet]
    #[arg(long, value_name = "FILE.parquet")]
    metrics: Option<PathBuf>,
    /// Continue an interrupted run of the same settings from its checkpoint beside the weights, <name>.checkpoint.safetensors; the log goes on too
    #[arg(long)]
    pub resume: bool,
    /// Time between two checkpoints; 0 = only when training is interrupted
    #[arg(long, value_name = "SECONDS", default_value_t = 60)]
    checkpoint_every: u64,
    #[command(flatten)]
    live: LiveArgs,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    let flags = [("train.rho", args.rho.map(|v| v.to_string())), ("train.alpha", args.alpha.clone())];
    let mut learning = Learning::of(&args.settings, &args.columns, args.dataset.as_deref(), &flags)?;
    let dir = learning.dataset.clone();
    let model = learning.path_or(args.dynamics.as_deref(), "dynamics.safetensors");
    let method = args.method.name();
    // As `make all METHOD=bc` has it: another method replaces no policy of hil.
    let name = if args.method == MethodName::Hil { "policy.safetensors".into() } else { format!("policy-{method}.safetensors") };
    let out = learning.path_or(args.out.as_deref(), &name);
    let metrics = args.metrics.clone().unwrap_or_else(|| beside(&out, "training.parquet"));
    let needs_demos = args.method.needs_demos();
    if matches!(args.method, MethodName::Ppo | MethodName::BcRl) {
        learning.simulated(&format!("--method {method}"))?;
    }
    let needs_model = args.method.needs_dynamics() || args.method == MethodName::Bc && args.dynamics.is_some();
    let kept = beside(&out, checkpoint::ENDING);
    let read = needs_demos.then_some(dir.as_path()).into_iter().chain(needs_model.then_some(model.as_path()));
    let places = args.settings.places(&context.console).read_all(read);
    let places =
        places.write("--out", &out, Content::Weights(KIND, "train")).write("--metrics", &metrics, Content::Table("train"));
    let checkpoint = if args.resume { Content::Own } else { Content::Weights(weights::CHECKPOINT, "train") };
    args.live.places(places.write("the checkpoint", &kept, checkpoint)).check(&context.console)?;
    let (demos, dataset) = needs_demos.then(|| read_demos(&mut learning, &args.settings, context)).transpose()?.unzip();
    let (dynamics, model) = needs_model.then(|| learning.dynamics(&model)).transpose()?.unzip();
    let inputs = [dataset.map(|content| ("dataset", content)), model.map(|content| ("dynamics", content))];
    let inputs: Vec<_> = inputs.into_iter().flatten().collect();
    let mut provenance = learning.provenance(&args.settings, Stage::Train, &inputs)?;
    provenance.settings["method"] = method.into();

    let (console, seed) = (&context.console, args.settings.seed);
    let resume = if args.resume { checkpoint::read(&kept, &provenance)? } else { None };
    announce(console, args.resume, resume.as_ref(), &kept);
    let mut keeper = Keeper::new(&kept, &provenance, console, resume.as_ref());
    let settings = learning.train_settings();
    let reward = if args.method == MethodName::BcRl { settings.bc_rl.reward } else { settings.ppo.reward };
    let world = |horizon_steps| -> Result<Box<dyn Env>> {
        let pipeline = learning.simulated("learning by trial")?;
        Ok(Box::new(TaskEnv::new(pipeline, reward, horizon_steps, seed)))
    };
    let learner: Box<dyn Method> = match demos {
        None => {
            let pipeline = learning.simulated("learning by trial")?;
            Box::new(Ppo::new(&pipeline.task.layout(&pipeline.robot), settings, seed, world)?)
        }
        Some(inputs) if args.method == MethodName::BcRl => Box::new(BcRl::new(inputs, settings, seed, world)?),
        Some(inputs) => imitator(args.method, inputs, dynamics, settings, seed)?,
    };
    let mut epochs = Epochs::new(console);
    let mut live = Live::begin("train", &args.live, resume.as_ref(), learner.metrics(), console)?;
    let hooks = Hooks {
        log: Box::new(|epoch, metrics| {
            epochs.step(epoch, metrics);
            live.step(epoch, metrics);
        }),
        score: Box::new(|policy| successes(learning.simulated("train.select_episodes")?, seed, policy, &context.interrupt)),
        keep: Box::new(|checkpoint| keeper.keep(checkpoint)),
        keep_every: (args.checkpoint_every > 0).then(|| Duration::from_secs(args.checkpoint_every)),
        resume,
        interrupt: &context.interrupt,
    };
    let trained = learn::run(learner, settings, hooks).map_err(|why| keeper.explain(why))?;
    epochs.finish();
    let mut meta = trained.policy.meta();
    if let Some(selection) = &trained.selection {
        meta["selection"] = stated(selection, settings.select_episodes, seed);
    }
    let weights = weights::encode(&out, KIND, &trained.policy.to_tensors(), &meta, &provenance)?;
    let table = table_file::encode(&metrics, &trained.metrics, &provenance)?;
    atomic::write_all(&[(metrics, table), (out.clone(), weights)])?;
    keeper.remove()?;
    console.say(&format!("train: wrote {}", out.display()));
    Ok(Outcome::Done)
}

/// Says where training starts.
fn announce(console: &Console, resume: bool, checkpoint: Option<&Checkpoint>, path: &Path) {
    let path_shown = path.display();
    match checkpoint {
        Some(checkpoint) => console.say(&format!("train: continues after {}, from {path_shown}", checkpoint.after())),
        None if resume => console.say(&format!("train: there is no {path_shown} to continue from; starts from the beginning")),
        None if path.exists() => {
            console.say(&format!("train: starts from the beginning; {path_shown} of an interrupted run will be replaced"));
        }
        None => {}
    }
}

/// Episodes of the selection that a policy solves.
fn successes(pipeline: &Pipeline, seed: u64, policy: &Policy, interrupt: &Interrupt) -> Result<u64> {
    let policy = Arc::new(policy.clone());
    let controller = |_, _: &Scene| {
        let controller: Box<dyn Controller> = Box::new(PolicyController::new(Arc::clone(&policy), None));
        Ok(Some(controller))
    };
    let trials = Rollouts::selection(pipeline, seed, policy.horizon_steps()).run(controller, interrupt, |_| Ok(()))?;
    Ok(trials.iter().filter(|trial| trial.success).count() as u64)
}

/// The selection as the description of the weights has it.
fn stated(selection: &Selection, episodes: u64, seed: u64) -> Value {
    json!({ "episodes": episodes, "seed": seed, "candidates": selection.candidates, "chosen": selection.best() })
}

fn read_demos(learning: &mut Learning, args: &SettingsArgs, context: &Context) -> Result<(Inputs, ContentHash)> {
    let Demos { train, validation, content } = learning.demos(args, &context.console)?;
    Ok((Inputs::new(train, validation)?, content))
}
