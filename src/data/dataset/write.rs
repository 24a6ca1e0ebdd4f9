//! Writing a dataset: windows of episodes become row groups on all threads and are appended in their order.

use super::episode::{DatasetEpisode, Episodes};
use super::episodes::{EpisodeTable, Row};
use super::features::{self, Cells, Feature, features};
use super::files::{Encoder, RowGroup, Series};
use super::meta::{self, DATA};
use super::sizes::Sizes;
use super::stats::stats;
use super::whole::Whole;
use crate::data::{Provenance, parquet_file};
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use crate::layout::Layout;
use crate::robot::Robot;
use crate::task::Task;
use arrow_schema::Schema;
use parquet::errors::ParquetError;
use rayon::prelude::*;
use std::fs;
use std::path::Path;
use std::sync::Arc;

/// What the datasets of one call share.
pub(super) struct Content<'a> {
    pub(super) robot: &'a Robot,
    pub(super) task: &'a Task,
    pub(super) layout: Arc<Layout>,
    pub(super) provenance: &'a Provenance,
    pub(super) interrupt: &'a Interrupt,
    pub(super) sizes: Sizes,
}

/// An episode on its way into the files.
struct Encoded {
    cells: Vec<Cells>,
    group: RowGroup,
    row: Row,
}

impl<'a> Content<'a> {
    /// Cut as all datasets are.
    pub(super) fn new((robot, task): (&'a Robot, &'a Task), provenance: &'a Provenance, interrupt: &'a Interrupt) -> Self {
        Content { robot, task, layout: task.layout(robot), provenance, interrupt, sizes: Sizes::USUAL }
    }

    /// Writes one dataset into the empty directory `dir`.
    pub(super) fn fill(&self, dir: &Path, episodes: &Episodes) -> Result<()> {
        if episodes.steps.is_empty() {
            return Err(Error::input(dir, "a dataset needs at least one episode, none is left"));
        }
        fs::create_dir_all(dir).map_err(|e| Error::io(dir, "create", e))?;
        let features = features(&self.layout);
        let schema = Schema::new(features.iter().map(features::field).collect::<Vec<_>>());
        let encoder = Encoder::new(schema, self.provenance).map_err(|e| parquet_file::cannot_encode(dir, e))?;
        let mut data = Series::new(dir, DATA, &encoder, self.provenance, self.sizes.file_bytes);
        let mut table = EpisodeTable::new(dir, self.task, &features, self.provenance, self.sizes)?;
        let mut whole = Whole::new(&features, dir)?;
        let (mut number, mut first) = (0, 0);
        while number < episodes.steps.len() {
            let window = self.window(&episodes.steps, number, first);
            let encoded = window.par_iter().map(|(number, first)| {
                self.interrupt.check()?;
                let episode = (episodes.give)(*number)?;
                self.check(dir, &episode, episodes.steps[*number])?;
                encode(&features, &encoder, &episode, *number, *first).map_err(|e| parquet_file::cannot_encode(dir, e))
            });
            // One after the other: of several errors the first is told, whatever the threads.
            let encoded = encoded.collect::<Vec<_>>().into_iter().collect::<Result<Vec<Encoded>>>()?;
            whole.add(&encoded.iter().map(|episode| episode.cells.as_slice()).collect::<Vec<_>>())?;
            for Encoded { group, row, .. } in encoded {
                (number, first) = (number + 1, first + row.length);
                table.append(data.place(), row)?;
                data.append(group)?;
            }
        }
        let files = data.finish()?.into_iter().chain(table.finish()?);
        meta::write(
            dir,
            (self.robot, self.task, &self.layout),
            &features,
            (number, first),
            &whole.finish(self.interrupt)?,
            self.provenance,
            files,
        )
    }

    /// The episodes that come next: their numbers, and those of their first frames.
    fn window(&self, steps: &[usize], number: usize, first: usize) -> Vec<(usize, usize)> {
        let mut window = vec![(number, first)];
        let (mut next, mut frame) = (number, first + steps[number]);
        while next + 1 < steps.len() && frame + steps[next + 1] - first <= self.sizes.window_frames {
            next += 1;
            window.push((next, frame));
            frame += steps[next];
        }
        window
    }

    fn check(&self, dir: &Path, episode: &DatasetEpisode, expected: usize) -> Result<()> {
        let (number, steps) = (episode.source_index, episode.demo.len());
        let wrong = |what: String| Err(Error::input(dir, what));
        let layout = episode.demo.layout();
        if *layout != self.layout {
            return wrong(format!("episode {number} is of {}, the dataset of {}, or of another robot", layout.name, self.task));
        }
        if steps != expected {
            return wrong(format!("episode {number} has {steps} actions, {expected} were announced"));
        }
        if episode.rewards.len() != steps {
            return wrong(format!("episode {number} has {} rewards for {steps} actions", episode.rewards.len()));
        }
        if let Some(t) = episode.rewards.iter().position(|r| !r.is_finite()) {
            return wrong(format!("reward {t} of episode {number} is {}", episode.rewards[t]));
        }
        Ok(())
    }
}

/// The row group of an episode, and its row in the table of episodes.
fn encode(
    features: &[Feature],
    encoder: &Encoder,
    episode: &DatasetEpisode,
    number: usize,
    first: usize,
) -> std::result::Result<Encoded, ParquetError> {
    let cells = features::cells(features, episode, number, first);
    let group = encoder.encode(cells.iter().zip(features).map(|(cells, feature)| cells.to_array(feature.width)).collect())?;
    let stats = cells.iter().zip(features).map(|(cells, feature)| stats(&cells.to_f64(), feature.width)).collect();
    Ok(Encoded { cells, group, row: Row { length: episode.demo.len(), stats } })
}
