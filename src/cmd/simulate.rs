use super::common::{SettingsArgs, path_or};
use super::fits::{same_robot, same_task};
use super::places::Content;
use super::shard::Shard;
use super::unfinished::{self, Unfinished};
use super::{Context, Outcome};
use crate::config::{Pipeline, SimulateSettings, Stage};
use crate::data::origin::Kind;
use crate::data::{Provenance, atomic, recording, table_file};
use crate::demo::Episode;
use crate::error::{Error, Result};
use crate::plan::{Plan, Plans};
use crate::sim::{Follower, execute};
use crate::task::FailureClass;
use rayon::prelude::*;
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Execute plans in contact physics, with noise on every command, and record each episode as an MCAP file. Stopped, the same command goes on.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  hilt simulate --plans plans.parquet --out recordings")]
pub struct Args {
    #[command(flatten)]
    settings: SettingsArgs,
    /// Plans to execute [default: runs/<TASK>/plans.parquet]
    #[arg(long, value_name = "FILE")]
    plans: Option<PathBuf>,
    /// Execute only the first N plans [default: all]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u64).range(1..))]
    episodes: Option<u64>,
    /// Directory of recordings to write [default: runs/<TASK>/recordings]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Do only share I of N, into the directory beside the output, <name>.unfinished; without --shard the shares in there are put together
    #[arg(long, value_name = "I/N", allow_hyphen_values = true)]
    shard: Option<Shard>,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    let pipeline = args.settings.resolve_from(args.plans.as_deref().map(|path| (path, Kind::Table)), &[])?;
    let path = path_or(args.plans.as_deref(), &pipeline, "plans.parquet");
    let out = path_or(args.out.as_deref(), &pipeline, "recordings");
    let kept = unfinished::beside_dir(&out)?;
    let places = args.settings.places(&context.console).read(&path).write("--out", &out, Content::Recordings("simulate"));
    places.write("the directory of what is unfinished", &kept, Content::Pieces).check(&context.console)?;
    let plans = table_file::Reader::open(&path)?;
    same_task(&path, plans.provenance(), &pipeline)?;
    same_robot(&path, plans.provenance(), &pipeline)?;
    let mut numbers = check_plans(&path, &pipeline, &plans, context)?;
    numbers.truncate(args.episodes.map_or(usize::MAX, |n| n as usize));
    let provenance = args.settings.provenance(Stage::Simulate, &pipeline, &[("plans", plans.content())])?;

    let share: Vec<u64> = numbers.iter().copied().filter(|n| args.shard.is_none_or(|shard| shard.takes(*n))).collect();
    let origin = |piece: &Path| recording::read(piece).map(|(_, origin)| origin);
    let work = Unfinished::begin(Some(kept), &provenance, share.len() as u64, "simulate", &context.console, origin)?;
    let stage = SimulateStage {
        settings: &pipeline.simulate,
        seed: args.settings.seed,
        provenance: &provenance,
        work: &work,
        context,
        totals: Totals::default(),
    };
    let done = stage.simulate(&share, Plans::new(&path, (&pipeline.robot, &pipeline.task), plans.tables()?)).and_then(|()| {
        match args.shard {
            Some(shard) => {
                work.say_shared(shard);
                Ok(false)
            }
            None => stage.put_together(&out, &numbers).map(|()| true),
        }
    });
    match done {
        Ok(true) => {
            work.remove()?;
            context.console.say(&format!("simulate: wrote {}", out.display()));
            Ok(Outcome::Done)
        }
        Ok(false) => Ok(Outcome::Done),
        Err(why) => Err(work.explain(why)),
    }
}

/// Reads all plans before the work begins, so that what cannot be executed is known then; returns their numbers.
fn check_plans(path: &Path, of: &Pipeline, plans: &table_file::Reader, context: &Context) -> Result<Vec<u64>> {
    let number = |plan: Result<Plan>| {
        context.interrupt.check()?;
        let plan = plan?;
        follower(path, &plan).map(|_| plan.index)
    };
    let numbers = Plans::new(path, (&of.robot, &of.task), plans.tables()?).map(number).collect::<Result<Vec<_>>>()?;
    if numbers.is_empty() {
        return Err(Error::input(path, "holds no plan; run `hilt plan` again"));
    }
    Ok(numbers)
}

fn follower(path: &Path, plan: &Plan) -> Result<Follower> {
    let unusable = || Error::input(path, format!("plan {} has no approach or no carry; run `hilt plan` again", plan.index));
    Follower::new(plan).ok_or_else(unusable)
}

/// What is said of all episodes in the end.
#[derive(Default)]
struct Totals {
    solved: AtomicU64,
    broken: AtomicU64,
    steps: AtomicU64,
}

impl Totals {
    fn add(&self, episode: &Episode) {
        self.solved.fetch_add(u64::from(episode.success), Ordering::Relaxed);
        self.broken.fetch_add(u64::from(episode.failure == Some(FailureClass::SimulationBrokeDown)), Ordering::Relaxed);
        self.steps.fetch_add(episode.steps.len() as u64, Ordering::Relaxed);
    }
}

/// What all its steps need.
struct SimulateStage<'a> {
    settings: &'a SimulateSettings,
    seed: u64,
    provenance: &'a Provenance,
    work: &'a Unfinished<'a>,
    context: &'a Context,
    totals: Totals,
}

impl SimulateStage<'_> {
    /// Executes the plans of this share that are not recorded yet.
    fn simulate(&self, share: &[u64], plans: impl Iterator<Item = Result<Plan>> + Send) -> Result<()> {
        let done = self.done(share)?;
        let progress = self.context.console.progress("simulate", share.len() as u64, "episodes").after(done.len() as u64);
        let missing: HashSet<u64> = share.iter().copied().filter(|number| !done.contains(number)).collect();
        // One by one, in order: the plans are in memory a few at a time.
        let wanted = plans.filter(|plan| plan.as_ref().map_or(true, |plan| missing.contains(&plan.index)));
        wanted.par_bridge().try_for_each(|plan| {
            self.record(&plan?)?;
            progress.step();
            Ok(())
        })?;
        let Totals { solved, broken, steps } = &self.totals;
        let [solved, broken, steps] = [solved, broken, steps].map(|total| total.load(Ordering::Relaxed));
        progress.finish(&format!(", {steps} control steps, {solved} solved"));
        if broken > 0 {
            let keys = "scene.obstacles, scene.friction and scene.block_mass_kg";
            self.context
                .console
                .say(&format!("simulate: the simulation broke down in {broken} episodes, recorded as failed: look at {keys}"));
        }
        Ok(())
    }

    fn record(&self, plan: &Plan) -> Result<()> {
        let interrupt = &self.context.interrupt;
        interrupt.check()?;
        let name = recording::file_name(plan.index);
        let follower = follower(&self.work.at(&name), plan)?;
        let episode = execute(plan, follower, self.settings, self.seed, interrupt)?;
        self.totals.add(&episode);
        self.work.put(&name, &recording::encode(&self.work.at(&name), &episode, self.provenance)?, 1)
    }

    /// The episodes of this share that are recorded already; says how many.
    fn done(&self, share: &[u64]) -> Result<HashSet<u64>> {
        let files = recording::files(self.work.dir())?;
        let there: HashSet<u64> = files.iter().filter_map(|file| recording::number_of(file.file_name()?.to_str()?)).collect();
        let there: Vec<u64> = share.iter().copied().filter(|number| there.contains(number)).collect();
        let look = |number: &u64| {
            self.context.interrupt.check()?;
            let whole = recording::read(&self.work.at(&recording::file_name(*number))).ok();
            let whole = whole.filter(|(episode, origin)| episode.index == *number && *origin == *self.provenance);
            Ok(whole.map(|(episode, _)| {
                self.totals.add(&episode);
                *number
            }))
        };
        let whole: Vec<Option<u64>> = there.par_iter().map(look).collect::<Result<_>>()?;
        let whole: HashSet<u64> = whole.into_iter().flatten().collect();
        self.work.say_found(whole.len() as u64, there.len() - whole.len());
        Ok(whole)
    }

    /// Puts the recordings into their directory. They stay among the pieces until it is in place.
    fn put_together(&self, out: &Path, numbers: &[u64]) -> Result<()> {
        atomic::write_dir(out, recording::is_file, |dir| {
            numbers.iter().try_for_each(|number| {
                self.context.interrupt.check()?;
                let name = recording::file_name(*number);
                atomic::link(&self.work.at(&name), &dir.join(&name))
            })
        })
    }
}
