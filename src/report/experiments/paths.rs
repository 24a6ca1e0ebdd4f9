//! The paper's Figure 8: the block's paths of the same episodes under each policy.

use super::finished::{Finished, Measured};
use crate::data::origin::Kind;
use crate::data::recording;
use crate::demo::Episode;
use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::report::chart::{LOOKS, Path, Site, Space};
use crate::report::page::{Block, Cell, Column, Table};

/// Episodes that are shown of each policy, as many as the paper's figure has.
const EPISODES: usize = 3;

/// A figure for each task and preset, and how each episode ended.
///
/// # Errors
/// What reading recordings returns; [`crate::error::Error::Interrupted`].
pub fn blocks(finished: &Finished, interrupt: &Interrupt) -> Result<Vec<Block>> {
    let mut blocks = Vec::new();
    for task in finished.tasks() {
        for preset in &finished.experiment.presets {
            let mut shown = Vec::new();
            for measured in first_seeds(finished, task, preset) {
                interrupt.check()?;
                if let Some(episodes) = episodes(finished, measured)? {
                    shown.push((finished.label(super::Arm::of(&measured.run)), measured.run.seed, episodes));
                }
            }
            if !shown.is_empty() {
                blocks.extend([figure(finished, task, preset, &shown), Block::Table(table(task, preset, &shown))]);
            }
        }
    }
    if blocks.is_empty() {
        blocks.push(Block::Words("No finished evaluation was recorded; the experiment needs `record = true`.".into()));
    }
    Ok(blocks)
}

/// One policy, its seed, and its episodes.
type Shown = (String, u64, Vec<Episode>);

/// Each arm's run of its first seed.
fn first_seeds<'a>(finished: &'a Finished, task: &'a str, preset: &'a str) -> impl Iterator<Item = &'a Measured> {
    let arms = finished.arms().into_iter().filter(move |arm| arm.preset == preset);
    arms.filter_map(move |arm| finished.of(arm, task).min_by_key(|m| m.run.seed))
}

/// The first episodes of a recorded evaluation.
fn episodes(finished: &Finished, measured: &Measured) -> Result<Option<Vec<Episode>>> {
    let outputs = &finished.grid.steps[measured.run.evaluate].outputs;
    let Some(rollouts) = outputs.iter().find(|output| output.kind == Kind::Recordings) else { return Ok(None) };
    let files = recording::files(&rollouts.path)?;
    files.iter().take(EPISODES).map(|file| recording::read(file).map(|(episode, _)| episode)).collect::<Result<_>>().map(Some)
}

fn figure(finished: &Finished, task: &str, preset: &str, shown: &[Shown]) -> Block {
    let path = |(i, episode): (usize, &Episode)| {
        let points = episode.steps.iter().chain([&episode.last]).map(|step| step.objects[0].pose.position_m).collect();
        Path { number: i % LOOKS + 1, points, target: episode.scene.target_m(0) }
    };
    let panels = shown.iter().map(|(name, seed, episodes)| Site {
        title: format!("{name}, seed {seed}"),
        paths: episodes.iter().enumerate().map(path).collect(),
    });
    let space = Space {
        id: format!("{}-{task}-{preset}", finished.experiment.name),
        title: format!("Paths of the block: {task}, preset {preset}"),
        description: "The block's path from where it lay (I) to where the episode left it (G), a panel for each policy; the table below says how each ended".into(),
        note: "dots, I: where the block lay; markers, G: where it ended; circles: where it was to go".into(),
        panels: panels.collect(),
    };
    let caption = "Paths of the block's centre in the first episodes of each policy's evaluation; episodes of the same number have the same start and \
                   the same noise. The paper's Figure 8.";
    Block::Figure(space.draw(), caption.into())
}

fn table(task: &str, preset: &str, shown: &[Shown]) -> Table {
    let row = |(name, _, episodes): &Shown| {
        let outcome = |episode: &Episode| {
            let end = match episode.failure {
                None => "solved".to_string(),
                Some(class) => class.name().replace('_', " "),
            };
            let highest =
                episode.steps.iter().chain([&episode.last]).map(|s| s.objects[0].pose.position_m[2]).fold(0.0, f64::max);
            Cell::from(format!("{end}, {} steps, up to {highest:.2} m", episode.steps.len()))
        };
        let mut cells = vec![Cell::from(name.clone())];
        cells.extend((0..EPISODES).map(|i| episodes.get(i).map_or("–".into(), outcome)));
        cells
    };
    let mut columns = vec![Column::words("")];
    columns.extend((1..=EPISODES).map(|i| Column::words(&format!("I{i} to G{i}"))));
    Table {
        caption: format!("How these episodes ended: {task}, preset {preset}."),
        columns,
        rows: shown.iter().map(row).collect(),
    }
}
