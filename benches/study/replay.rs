//! The executed actions of recordings once more, and nothing beside: control steps per second of the physics alone, for comparison
//! with other engines (`benches/peers/mujoco.py`).

use super::Args;
use super::trials::processor_s;
use anyhow::{Context, Result, ensure};
use hilt::data::recording;
use hilt::demo::Episode;
use hilt::sim::World;
use std::fs;
use std::path::{Path, PathBuf};

/// Of so many runs of each episode the fastest counts.
const ROUNDS: usize = 3;

/// Prints control steps per second of processor time.
pub fn run(args: &Args) -> Result<()> {
    let dir = args.recordings.as_deref().context("give --recordings DIR of one simulate stage")?;
    let episodes = read(dir)?;
    let steps: usize = episodes.iter().map(|episode| episode.steps.len()).sum();
    let mut best = vec![f64::INFINITY; episodes.len()];
    for _ in 0..ROUNDS {
        for (episode, best) in episodes.iter().zip(&mut best) {
            let start = processor_s();
            again(episode)?;
            *best = best.min(processor_s() - start);
        }
    }
    println!("{:.0}", steps as f64 / best.iter().sum::<f64>());
    Ok(())
}

fn read(dir: &Path) -> Result<Vec<Episode>> {
    let entries = fs::read_dir(dir).with_context(|| format!("cannot read {}", dir.display()))?;
    let mut paths: Vec<PathBuf> = entries.map(|entry| Ok(entry?.path())).collect::<Result<_>>()?;
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "mcap"));
    paths.sort();
    paths.iter().map(|path| Ok(recording::read(path)?.0)).collect()
}

fn again(episode: &Episode) -> Result<()> {
    let mut world = World::new(&episode.scene);
    episode.steps.iter().for_each(|step| world.step(&step.executed));
    let (now, then) = (world.observe().state, &episode.last.state);
    ensure!(now.q == then.q, "episode {} ends elsewhere than its recording by this version of hilt", episode.index);
    Ok(())
}
