use super::common::{SettingsArgs, path_or};
use super::places::Content;
use super::shard::Shard;
use super::unfinished::{self, Unfinished};
use super::{Context, Outcome, dropped};
use crate::config::{Pipeline, Stage};
use crate::data::{Provenance, table_file};
use crate::error::{Error, Result};
use crate::plan::{Block, Plan, Planned, Planner, block_from_table, block_to_table, plan_episode, to_table};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Plan demonstrations: random scenes, and for each a collision-free, smooth joint trajectory. Stopped, the same command goes on.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  hilt plan --task stack --episodes 20 --out plans.parquet\n  hilt plan --task tower --robot panda --episodes 2 --out tower.parquet"
)]
pub struct Args {
    #[command(flatten)]
    settings: SettingsArgs,
    /// Demonstrations to plan [default: plan.episodes]
    #[arg(long, value_name = "N")]
    episodes: Option<u64>,
    /// Parquet file to write [default: runs/<TASK>/plans.parquet]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Do only share I of N, into the directory beside the file, <name>.unfinished; without --shard the shares in there are put together
    #[arg(long, value_name = "I/N", allow_hyphen_values = true)]
    shard: Option<Shard>,
}

/// For when no scene has a plan.
const ADVICE: &str = "change the scene (scene.spawn_x_m, scene.spawn_y_m, scene.obstacles) or allow more plan.search_iterations";

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    let pipeline = args.settings.resolve(&[("plan.episodes", args.episodes.map(|n| n.to_string()))])?;
    let out = path_or(args.out.as_deref(), &pipeline, "plans.parquet");
    let kept = unfinished::beside_file(&out)?;
    if let (Some(shard), None) = (args.shard, &kept) {
        let out = out.display();
        return Err(Error::Usage(format!(
            "--shard {shard}: --out {out} is no file, beside which the share could be kept; name one"
        )));
    }
    let places = args.settings.places(&context.console).write("--out", &out, Content::Table("plan"));
    let places =
        kept.iter().fold(places, |places, kept| places.write("the directory of what is unfinished", kept, Content::Pieces));
    places.check(&context.console)?;
    let provenance = args.settings.provenance(Stage::Plan, &pipeline, &[])?;

    let blocks: Vec<Block> = Block::all(pipeline.plan.episodes).collect();
    let share: Vec<Block> = blocks.iter().copied().filter(|b| args.shard.is_none_or(|shard| shard.takes(b.number()))).collect();
    let origin = |piece: &Path| table_file::read(piece).map(|(_, origin)| origin);
    let work = Unfinished::begin(kept, &provenance, count(&share), "plan", &context.console, origin)?;
    let stage = PlanStage { pipeline: &pipeline, seed: args.settings.seed, provenance: &provenance, work: &work, context };
    let done = stage.plan(&share).and_then(|()| match args.shard {
        Some(shard) => {
            work.say_shared(shard);
            Ok(None)
        }
        None => stage.put_together(&out, &blocks).map(Some),
    });
    let reasons = match done {
        Ok(Some(reasons)) => reasons,
        Ok(None) => return Ok(Outcome::Done),
        Err(why) => return Err(work.explain(why)),
    };
    work.remove()?;
    let outcome = dropped::say("plan", pipeline.plan.episodes as usize, &reasons, ADVICE, &context.console)?;
    context.console.say(&format!("plan: wrote {}", out.display()));
    Ok(outcome)
}

/// Episodes of these blocks.
fn count<'a>(blocks: impl IntoIterator<Item = &'a Block>) -> u64 {
    blocks.into_iter().map(|block| block.episodes().count() as u64).sum()
}

/// What all its steps need.
struct PlanStage<'a> {
    pipeline: &'a Pipeline,
    seed: u64,
    provenance: &'a Provenance,
    work: &'a Unfinished<'a>,
    context: &'a Context,
}

impl PlanStage<'_> {
    /// Plans what is not there yet. Episodes go to the threads one by one, in order, so that few blocks are under way at any time.
    fn plan(&self, share: &[Block]) -> Result<()> {
        let missing = self.missing(share)?;
        let (all, left) = (count(share), count(&missing));
        let progress = self.context.console.progress("plan", all, "plans").after(all - left);
        let begun = Mutex::new(BTreeMap::<Block, Planned>::new());
        let episodes = missing.iter().flat_map(|block| block.episodes().map(|episode| (*block, episode)));
        episodes.par_bridge().try_for_each_init(
            || {
                Planner::new(&self.pipeline.robot, &self.pipeline.task, &self.pipeline.plan)
                    .with_interrupt(&self.context.interrupt)
            },
            |planner, (block, episode)| {
                let planned = self.plan_one(planner, episode)?;
                progress.step();
                let whole = {
                    let mut begun = begun.lock().unwrap_or_else(PoisonError::into_inner);
                    let entry = begun.entry(block).or_default();
                    entry.push((episode, planned));
                    if entry.len() == block.episodes().count() { begun.remove(&block) } else { None }
                };
                whole.map_or(Ok(()), |planned| self.keep(block, planned))
            },
        )?;
        progress.finish("");
        Ok(())
    }

    fn plan_one(&self, planner: &mut Planner, episode: u64) -> Result<dropped::Kept<Plan>> {
        let plan = plan_episode(planner, self.pipeline, (self.seed, episode), &self.context.interrupt)?;
        Ok(plan.map_err(|e| format!("episode {episode}: {e}")))
    }

    fn keep(&self, block: Block, mut planned: Planned) -> Result<()> {
        planned.sort_by_key(|(episode, _)| *episode);
        let (name, episodes) = (block.file_name(), planned.len() as u64);
        let bytes = table_file::encode(&self.work.at(&name), &block_to_table(&self.pipeline.robot, planned), self.provenance)?;
        self.work.put(&name, &bytes, episodes)
    }

    /// Says what is there already; returns what is not.
    fn missing(&self, share: &[Block]) -> Result<Vec<Block>> {
        let look = |block: &Block| {
            self.context.interrupt.check()?;
            let there = self.work.at(&block.file_name()).exists();
            Ok((*block, there, there && self.read(*block).is_ok()))
        };
        let found = share.par_iter().map(look).collect::<Result<Vec<_>>>()?;
        let whole = count(found.iter().filter(|(.., whole)| *whole).map(|(block, ..)| block));
        self.work.say_found(whole, found.iter().filter(|(_, there, whole)| *there && !whole).count());
        Ok(found.into_iter().filter(|(.., whole)| !whole).map(|(block, ..)| block).collect())
    }

    /// A block that is done.
    fn read(&self, block: Block) -> Result<Planned> {
        let path = self.work.at(&block.file_name());
        let (table, origin) = table_file::read(&path)?;
        if origin != *self.provenance {
            return Err(Error::input(&path, "is a piece of another run; remove it"));
        }
        block_from_table((&self.pipeline.robot, &self.pipeline.task), block, table).map_err(|why| Error::input(&path, why))
    }

    /// Writes the plans of all blocks, a block a row group; returns why episodes were dropped.
    fn put_together(&self, out: &Path, blocks: &[Block]) -> Result<Vec<String>> {
        let mut reasons = Vec::new();
        let groups = blocks.iter().filter_map(|block| {
            let planned = self.context.interrupt.check().and_then(|()| self.read(*block));
            let plans = planned.map(|planned| split(planned, &mut reasons));
            plans.map(|plans| (!plans.is_empty()).then(|| to_table(&self.pipeline.robot, &plans))).transpose()
        });
        table_file::write_groups(out, groups, self.provenance)?;
        Ok(reasons)
    }
}

/// The plans; the reasons of the others go to `reasons`.
fn split(planned: Planned, reasons: &mut Vec<String>) -> Vec<Plan> {
    let take = |(_, planned): (u64, dropped::Kept<Plan>)| planned.map_err(|reason| reasons.push(reason)).ok();
    planned.into_iter().filter_map(take).collect()
}
