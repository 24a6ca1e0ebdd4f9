use super::common::{SettingsArgs, path_or, same_task};
use super::places::Content;
use super::{Context, Outcome};
use crate::config::Stage;
use crate::data::{atomic, recording, table_file};
use crate::error::{Error, Result};
use crate::plan::{Plan, from_table};
use crate::robot::urdf::urdf;
use crate::seed;
use crate::sim::{Disturbance, Follower, run_episode};
use crate::tasks::FailureClass;
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Execute plans in contact physics, with noise on every command, and record each episode as an MCAP file.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    settings: SettingsArgs,
    /// Plans to execute [default: runs/<TASK>/plans.parquet]
    #[arg(long, value_name = "FILE")]
    plans: Option<PathBuf>,
    /// Execute only the first N plans [default: all]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    episodes: Option<u64>,
    /// Directory of recordings to write [default: runs/<TASK>/recordings]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    let pipeline = args.settings.resolve(&[])?;
    let path = path_or(args.plans.as_deref(), pipeline.task, "plans.parquet");
    let out = path_or(args.out.as_deref(), pipeline.task, "recordings");
    args.settings.places().read(&path).write("--out", &out, Content::Recordings("simulate")).check(&context.console)?;
    let (table, made, content) = table_file::read_hashed(&path)?;
    same_task(&path, made.task, pipeline.task)?;
    let mut plans = from_table(&table).map_err(|why| Error::input(&path, why))?;
    plans.truncate(args.episodes.map_or(usize::MAX, |n| n as usize));
    if plans.is_empty() {
        return Err(Error::input(&path, "holds no plan; run `hilt plan` again"));
    }
    let robot = urdf();
    let provenance = args.settings.provenance(Stage::Simulate, &pipeline, &[("plans", content)])?;

    let progress = context.console.progress("simulate", plans.len() as u64, "episodes");
    let (solved, broken, steps) = (AtomicU64::new(0), AtomicU64::new(0), AtomicU64::new(0));
    let record = |plan: &Plan, dir: &Path| -> Result<()> {
        context.interrupt.check()?;
        let noise = seed::stream(args.settings.seed, "simulate.noise", plan.index);
        let mut disturbance = Disturbance::new(&pipeline.simulate, noise);
        let unusable = || Error::input(&path, format!("plan {} has no approach or no carry; run `hilt plan` again", plan.index));
        let mut follower = Follower::new(plan).ok_or_else(unusable)?;
        let max_steps = pipeline.simulate.max_steps;
        let episode = run_episode(plan.index, &plan.scene, &mut follower, &mut disturbance, max_steps, &context.interrupt)?;
        solved.fetch_add(u64::from(episode.success), Ordering::Relaxed);
        broken.fetch_add(u64::from(episode.failure == Some(FailureClass::SimulationBrokeDown)), Ordering::Relaxed);
        steps.fetch_add(episode.steps.len() as u64, Ordering::Relaxed);
        let file = dir.join(recording::file_name(plan.index));
        atomic::write_new(&file, &recording::encode(&file, &episode, &robot, &provenance)?)?;
        progress.step();
        Ok(())
    };
    atomic::write_dir(&out, recording::is_file, |dir| plans.par_iter().try_for_each(|plan| record(plan, dir)))?;
    progress.finish(&format!(", {} control steps, {} solved", steps.into_inner(), solved.into_inner()));
    let broken = broken.into_inner();
    if broken > 0 {
        let keys = "scene.obstacles, scene.friction and scene.block_mass_kg";
        context
            .console
            .say(&format!("simulate: the simulation broke down in {broken} episodes, recorded as failed: look at {keys}"));
    }
    context.console.say(&format!("simulate: wrote {}", out.display()));
    Ok(Outcome::Done)
}
