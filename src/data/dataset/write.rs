//! Writing a dataset: windows of episodes become row groups on all threads and are appended in their order.

use super::cells::Cells;
use super::episode::{DatasetEpisode, Episodes};
use super::episodes::{EpisodeTable, Row};
use super::features::{self, Feature, features};
use super::files::{Encoder, RowGroup, Series};
use super::meta::{self, About, DATA};
use super::sizes::Sizes;
use super::stats::stats;
use super::whole::Whole;
use crate::data::{Provenance, parquet_file};
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use crate::layout::Layout;
use crate::robot::Robot;
use crate::state::CONTROL_HZ;
use crate::task::Task;
use arrow_schema::Schema;
use parquet::errors::ParquetError;
use rayon::prelude::*;
use std::fs;
use std::path::Path;
use std::sync::Arc;

/// What the datasets of hilt's own demos share.
pub(super) struct Content<'a> {
    task: &'a Task,
    layout: Arc<Layout>,
    pub(super) form: Form<'a>,
}

/// What the datasets of one call share, whoever wrote what they are made of.
pub(super) struct Form<'a> {
    pub(super) about: About,
    pub(super) features: Vec<Feature>,
    pub(super) provenance: &'a Provenance,
    pub(super) interrupt: &'a Interrupt,
    pub(super) sizes: Sizes,
}

/// An episode as it is written: its columns, numbered already, and what it shows.
pub(super) struct Episode {
    pub(super) cells: Vec<Cells>,
    pub(super) tasks: Vec<String>,
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
        let layout = task.layout(robot);
        let about = About {
            robot_type: Some(robot.name.clone()),
            fps: f64::from(CONTROL_HZ),
            tasks: vec![task.instruction.clone()],
            layout: Some(Arc::clone(&layout)),
        };
        let form = Form { about, features: features(&layout), provenance, interrupt, sizes: Sizes::USUAL };
        Content { task, layout, form }
    }

    /// Writes one dataset into the empty directory `dir`.
    pub(super) fn fill(&self, dir: &Path, episodes: &Episodes) -> Result<()> {
        let mut filling = Filling::new(&self.form, dir)?;
        let (mut number, mut first) = (0, 0);
        while number < episodes.steps.len() {
            let window = self.window(&episodes.steps, number, first);
            let give = |(number, first): &(usize, usize)| {
                let episode = (episodes.give)(*number)?;
                self.check(dir, &episode, episodes.steps[*number])?;
                let cells = features::cells(&self.form.features, &episode, *number, *first);
                Ok(Episode { cells, tasks: self.form.about.tasks.clone() })
            };
            filling.add(window.par_iter().map(give))?;
            first += window.iter().map(|(number, _)| episodes.steps[*number]).sum::<usize>();
            number += window.len();
        }
        filling.finish()
    }

    /// The episodes that come next: their numbers, and those of their first frames.
    fn window(&self, steps: &[usize], number: usize, first: usize) -> Vec<(usize, usize)> {
        let mut window = vec![(number, first)];
        let (mut next, mut frame) = (number, first + steps[number]);
        while next + 1 < steps.len() && frame + steps[next + 1] - first <= self.form.sizes.window_frames {
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

/// A dataset that is being written: episodes in their order, then the rest.
pub(super) struct Filling<'a> {
    form: &'a Form<'a>,
    dir: &'a Path,
    encoder: Encoder,
    data: Series<'a>,
    table: EpisodeTable<'a>,
    whole: Whole<'a>,
    /// Episodes and frames that are written.
    episodes: usize,
    frames: usize,
    /// Episodes that wait for their window, and their frames.
    waiting: Vec<Episode>,
    waiting_frames: usize,
}

impl<'a> Filling<'a> {
    /// An empty one in the empty directory `dir`.
    pub(super) fn new(form: &'a Form<'a>, dir: &'a Path) -> Result<Self> {
        fs::create_dir_all(dir).map_err(|e| Error::io(dir, "create", e))?;
        let schema = Schema::new(form.features.iter().map(features::field).collect::<Vec<_>>());
        let encoder = Encoder::new(schema, form.provenance).map_err(|e| parquet_file::cannot_encode(dir, e))?;
        Ok(Filling {
            data: Series::new(dir, DATA, &encoder, form.provenance, form.sizes.file_bytes),
            table: EpisodeTable::new(dir, &form.features, form.provenance, form.sizes)?,
            whole: Whole::new(&form.features, dir)?,
            form,
            dir,
            encoder,
            episodes: 0,
            frames: 0,
            waiting: Vec::new(),
            waiting_frames: 0,
        })
    }

    /// Numbers of the next episode and of its first frame.
    pub(super) fn next(&self) -> (usize, usize) {
        (self.episodes + self.waiting.len(), self.frames + self.waiting_frames)
    }

    /// Adds an episode; a window of them is written together.
    pub(super) fn push(&mut self, episode: Episode) -> Result<()> {
        self.waiting_frames += episode.cells[0].len() / self.form.features[0].width;
        self.waiting.push(episode);
        if self.waiting_frames >= self.form.sizes.window_frames { self.flush() } else { Ok(()) }
    }

    fn flush(&mut self) -> Result<()> {
        let waiting = std::mem::take(&mut self.waiting);
        self.waiting_frames = 0;
        self.add(waiting.into_par_iter().map(Ok))
    }

    /// Adds a window of episodes, encoded on all threads.
    fn add(&mut self, window: impl IndexedParallelIterator<Item = Result<Episode>>) -> Result<()> {
        let Filling { form, dir, encoder, .. } = self;
        let encoded = window.map(|episode| {
            form.interrupt.check()?;
            encode(&form.features, encoder, episode?).map_err(|e| parquet_file::cannot_encode(dir, e))
        });
        // One after the other: of several errors the first is told, whatever the threads.
        let encoded = encoded.collect::<Vec<_>>().into_iter().collect::<Result<Vec<Encoded>>>()?;
        self.whole.add(&encoded.iter().map(|episode| episode.cells.as_slice()).collect::<Vec<_>>())?;
        for Encoded { group, row, .. } in encoded {
            (self.episodes, self.frames) = (self.episodes + 1, self.frames + row.length);
            self.table.append(self.data.place(), row)?;
            self.data.append(group)?;
        }
        Ok(())
    }

    /// Writes what is left and the description.
    pub(super) fn finish(mut self) -> Result<()> {
        self.flush()?;
        if self.episodes == 0 {
            return Err(Error::input(self.dir, "a dataset needs at least one episode, none is left"));
        }
        let Filling { form, dir, data, table, whole, episodes, frames, .. } = self;
        let files = data.finish()?.into_iter().chain(table.finish()?);
        let whole = whole.finish(form.interrupt)?;
        meta::write(dir, &form.about, &form.features, (episodes, frames), &whole, form.provenance, files)
    }
}

/// The row group of an episode, and its row in the table of episodes.
fn encode(features: &[Feature], encoder: &Encoder, episode: Episode) -> std::result::Result<Encoded, ParquetError> {
    let Episode { cells, tasks } = episode;
    let group = encoder.encode(cells.iter().zip(features).map(|(cells, feature)| cells.to_array(feature.width)).collect())?;
    let stats = cells.iter().zip(features).map(|(cells, feature)| stats(&cells.to_f64(), feature.width)).collect();
    let length = cells[0].len() / features[0].width;
    Ok(Encoded { cells, group, row: Row { length, tasks, stats } })
}
