use super::common::{SettingsArgs, path_or, same_task};
use super::{Context, Outcome, output, train};
use crate::config::{Pipeline, Stage};
use crate::data::{atomic, json_file, table_file, weights};
use crate::error::{Error, Result};
use crate::eval::{PolicyController, Rollouts, Summary, Trial, to_table};
use crate::learn::Policy;
use crate::plan::Planner;
use crate::report::table::text_table;
use crate::scene::Scene;
use crate::seed;
use crate::sim::{Controller, Follower};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The demonstrator's name where a policy's file could stand.
const PLANNER: &str = "planner";

/// Run a policy on seeded episodes that no demonstration used: success with its 95 % interval, conditions, failure classes.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    settings: SettingsArgs,
    /// Weights of a policy, or "planner" for the demonstrator itself [default: runs/<TASK>/policy.safetensors]
    #[arg(long, value_name = "planner|FILE")]
    policy: Option<PathBuf>,
    /// Episodes [default: evaluate.episodes]
    #[arg(long, value_name = "N")]
    episodes: Option<u64>,
    /// Sample actions from the policy's Gaussian instead of taking its mean
    #[arg(long)]
    stochastic: bool,
    /// Print the summary as JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Write the summary to this JSON file and the log of the episodes beside it, as .parquet
    #[arg(long, value_name = "FILE.json")]
    out: Option<PathBuf>,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    let episodes = ("evaluate.episodes", args.episodes.map(|n| n.to_string()));
    let stochastic = ("evaluate.stochastic", args.stochastic.then(|| "true".to_string()));
    let pipeline = args.settings.resolve(&[episodes, stochastic])?;
    let path = path_or(args.policy.as_deref(), pipeline.task, "policy.safetensors");
    let by_planner = path == Path::new(PLANNER);

    let (trials, inputs): (_, Vec<(&str, &Path)>) = if by_planner {
        (planner(args, &pipeline, context)?, vec![])
    } else {
        (policy(args, &path, &pipeline, context)?, vec![("policy", &path)])
    };
    let summary = Summary::of(pipeline.task, &trials);
    if let Some(out) = &args.out {
        let mut provenance = args.settings.provenance(Stage::Evaluate, &pipeline, &inputs)?;
        provenance.settings["policy"] = if by_planner { PLANNER } else { train::KIND }.into();
        let value = serde_json::to_value(&summary).map_err(|e| Error::Failed(format!("cannot write JSON: {e}")))?;
        let log = out.with_extension("parquet");
        let table = table_file::encode(&log, &to_table(pipeline.task, &trials), &provenance)?;
        atomic::write_all(&[(log, table), (out.clone(), json_file::encode(out, &value, &provenance)?)])?;
    }
    if args.json {
        output::print_json(&summary)?
    } else {
        output::print(&words(&summary))?
    }
    Ok(Outcome::Done)
}

fn planner(args: &Args, pipeline: &Pipeline, context: &Context) -> Result<Vec<Trial>> {
    let horizon_steps = match pipeline.evaluate.horizon_steps {
        0 => pipeline.simulate.max_steps,
        given => given,
    };
    rollouts(args, pipeline, horizon_steps, context, |index, scene| {
        let plan =
            Planner::new(&pipeline.plan).plan(index, scene, &mut seed::stream(args.settings.seed, "evaluate.search", index));
        Ok(plan.ok().and_then(|plan| Follower::new(&plan)).map(|follower| Box::new(follower) as Box<dyn Controller>))
    })
}

fn policy(args: &Args, path: &Path, pipeline: &Pipeline, context: &Context) -> Result<Vec<Trial>> {
    let (tensors, meta, made) = weights::read(path, train::KIND)?;
    same_task(path, made.task, pipeline.task)?;
    let policy = Arc::new(Policy::from_tensors(&tensors, &meta).map_err(|why| Error::input(path, why))?);
    let horizon_steps = match pipeline.evaluate.horizon_steps {
        0 => policy.horizon_steps(),
        given => given,
    };
    rollouts(args, pipeline, horizon_steps, context, |index, _| {
        let sampling = pipeline.evaluate.stochastic.then(|| seed::stream(args.settings.seed, "evaluate.action", index));
        Ok(Some(Box::new(PolicyController::new(Arc::clone(&policy), sampling)) as Box<dyn Controller>))
    })
}

fn rollouts<F>(args: &Args, pipeline: &Pipeline, horizon_steps: u32, context: &Context, make: F) -> Result<Vec<Trial>>
where
    F: Fn(u64, &Scene) -> Result<Option<Box<dyn Controller>>> + Sync,
{
    if let Some(out) = &args.out {
        [out, &out.with_extension("parquet")].into_iter().try_for_each(|path| atomic::check_place(path))?;
    }
    let progress = context.console.progress("evaluate", pipeline.evaluate.episodes, "episodes");
    let trials =
        Rollouts { pipeline, seed: args.settings.seed, horizon_steps }.run(make, &context.interrupt, |_| progress.step())?;
    let steps: u64 = trials.iter().map(|t| t.steps).sum();
    progress.finish(&format!(", {steps} control steps, horizon {horizon_steps}"));
    Ok(trials)
}

/// The table for people.
fn words(summary: &Summary) -> String {
    let share = |n: u64| format!("{:.1} %", 100.0 * n as f64 / summary.episodes.max(1) as f64);
    let row = |name: &str, n: u64| vec![name.to_string(), n.to_string(), share(n)];
    let [low, high] = summary.wilson_95.map(|v| 100.0 * v);
    let mut rows = vec![row("success", summary.successes)];
    rows.extend(summary.task.condition_names().iter().map(|name| row(&format!("  {name}"), summary.conditions[*name])));
    rows.push(row("failed", summary.episodes - summary.successes));
    rows.extend(summary.failures.iter().filter(|(_, n)| **n > 0).map(|(class, n)| row(&format!("  {class}"), *n)));
    format!(
        "{}{}: success {} of {} (95 % interval {low:.1} to {high:.1} %), steps p50 {} p95 {}\n",
        text_table(&["at the end", "episodes", "share"], &rows),
        summary.task,
        summary.successes,
        summary.episodes,
        summary.episode_steps.p50,
        summary.episode_steps.p95
    )
}
