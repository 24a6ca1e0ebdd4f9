use super::common::{SettingsArgs, path_or};
use super::places::Content;
use super::{Context, Outcome, dropped};
use crate::config::Stage;
use crate::data::table_file;
use crate::error::{Error, Result};
use crate::plan::{Planner, to_table};
use crate::seed;
use crate::tasks::draw_scene;
use rayon::prelude::*;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};

/// Plan demonstrations: random scenes, and for each a collision-free, smooth joint trajectory.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    settings: SettingsArgs,
    /// Demonstrations to plan [default: plan.episodes]
    #[arg(long, value_name = "N")]
    episodes: Option<u64>,
    /// Parquet file to write [default: runs/<TASK>/plans.parquet]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Samples of all plans together, which stay in memory until they are written: 100,000 plans of the usual length \[control steps\].
const MOST_SAMPLES: u64 = 15_000_000;

/// For when no scene has a plan.
const ADVICE: &str = "change the scene (scene.spawn_x_m, scene.spawn_y_m, scene.obstacles) or allow more plan.search_iterations";

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    let pipeline = args.settings.resolve(&[("plan.episodes", args.episodes.map(|n| n.to_string()))])?;
    let (task, seed) = (pipeline.task, args.settings.seed);
    let out = path_or(args.out.as_deref(), task, "plans.parquet");
    args.settings.places().write("--out", &out, Content::Table("plan")).check(&context.console)?;
    let provenance = args.settings.provenance(Stage::Plan, &pipeline, &[])?;

    let progress = context.console.progress("plan", pipeline.plan.episodes, "plans");
    let all_samples = AtomicU64::new(0);
    let plans: Vec<dropped::Kept<_>> = (0..pipeline.plan.episodes)
        .into_par_iter()
        .map_init(
            || Planner::new(&pipeline.plan).with_interrupt(&context.interrupt),
            |planner, index| {
                context.interrupt.check()?;
                let scene = draw_scene(task, &pipeline.scene, &mut seed::stream(seed, "plan.scene", index))?;
                let plan = planner.plan(index, &scene, &mut seed::stream(seed, "plan.search", index));
                context.interrupt.check()?;
                let samples = plan.as_ref().map_or(0, |plan| plan.waypoints.len() as u64);
                if all_samples.fetch_add(samples, Ordering::Relaxed) + samples > MOST_SAMPLES {
                    return Err(Error::Failed(format!(
                        "the plans are longer than {MOST_SAMPLES} control steps together; lower plan.episodes, or raise plan.speed or \
                         plan.max_acceleration_rad_s2"
                    )));
                }
                progress.step();
                Ok(plan.map_err(|e| format!("episode {index}: {e}")))
            },
        )
        .collect::<Result<_>>()?;
    progress.finish("");
    let (plans, outcome) = dropped::keep("plan", plans, ADVICE, &context.console)?;
    table_file::write(&out, &to_table(&plans), &provenance)?;
    context.console.say(&format!("plan: wrote {}", out.display()));
    Ok(outcome)
}
