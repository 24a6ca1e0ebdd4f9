//! Frames on their way back into episodes: the rows of all data files, one after the other.

use super::DatasetEpisode;
use super::cells::Kind;
use super::check::{self, Info};
use super::features::{
    ACTION, DONE, ENVIRONMENT, EPISODE, EXECUTED, FRAME, Feature, INDEX, NEXT_ENVIRONMENT, NEXT_STATE, REWARD, SOURCE, STATE,
    SUCCESS, features, field,
};
use crate::data::parquet_file;
use crate::demo::Demo;
use crate::error::{Error, Result};
use crate::layout::Layout;
use arrow_array::cast::AsArray;
use arrow_array::types::{Float32Type, Int64Type};
use arrow_array::{Array, RecordBatch};
use arrow_buffer::BooleanBuffer;
use std::path::Path;
use std::sync::Arc;

/// The rows that were read, and the episode that they are in.
pub(super) struct Rows<F> {
    layout: Arc<Layout>,
    features: Vec<Feature>,
    /// What every episode is shown to.
    see: F,
    /// Rows so far.
    frames: usize,
    /// Episodes that have ended.
    episodes: usize,
    now: Episode,
    /// The first row that is not where it belongs, and the first thing wrong with an episode: told when the counts are right, which
    /// say more.
    misplaced: Option<String>,
    wrong: Option<String>,
}

/// The episode that the next row belongs to.
#[derive(Default)]
struct Episode {
    states: Vec<f32>,
    /// The state after the last row, which the next row must begin with.
    next: Vec<f32>,
    actions: Vec<f32>,
    executed: Vec<f32>,
    rewards: Vec<f32>,
    source: u64,
}

/// The columns of a batch that make an episode.
struct Batch<'a> {
    /// Both halves of a state, and those of the next.
    state: [(&'a [f32], usize); 2],
    next: [(&'a [f32], usize); 2],
    actions: &'a [f32],
    executed: &'a [f32],
    rewards: &'a [f32],
    /// Number of the frame in the dataset, of its episode, and of the frame in it.
    places: [&'a [i64]; 3],
    sources: &'a [i64],
    done: &'a BooleanBuffer,
    success: &'a BooleanBuffer,
}

impl<F: FnMut(DatasetEpisode) -> Result<()>> Rows<F> {
    /// No rows of a dataset of this layout.
    pub(super) fn new(layout: &Arc<Layout>, see: F) -> Self {
        let (features, now, layout) = (features(layout), Episode::default(), Arc::clone(layout));
        Rows { layout, features, see, frames: 0, episodes: 0, now, misplaced: None, wrong: None }
    }

    /// Adds the rows of one file.
    pub(super) fn append(&mut self, path: &Path, bytes: Vec<u8>) -> Result<()> {
        let mut wrong = None;
        let decoded = parquet_file::decode_each(bytes, &mut |batch| {
            self.append_batch(path, batch).map_err(|why| wrong = Some(why)).map_err(|()| String::new())
        });
        match (wrong, decoded) {
            (Some(why), _) => Err(why),
            (None, decoded) => decoded.map(drop).map_err(|e| Error::input(path, format!("cannot be decoded: {e}"))),
        }
    }

    fn append_batch(&mut self, path: &Path, batch: &RecordBatch) -> Result<()> {
        self.features.iter().try_for_each(|feature| self.check_column(path, batch, feature))?;
        let width = |name: &str| self.features.iter().find(|f| f.name == name).map_or(1, |f| f.width);
        let floats = |name: &str| {
            let column = batch[name].as_ref();
            let column = column.as_fixed_size_list_opt().map_or(column, |list| list.values().as_ref());
            column.as_primitive::<Float32Type>().values().as_ref()
        };
        let ints = |name: &str| batch[name].as_primitive::<Int64Type>().values().as_ref();
        let columns = Batch {
            state: [STATE, ENVIRONMENT].map(|name| (floats(name), width(name))),
            next: [NEXT_STATE, NEXT_ENVIRONMENT].map(|name| (floats(name), width(name))),
            actions: floats(ACTION),
            executed: floats(EXECUTED),
            rewards: floats(REWARD),
            places: [INDEX, EPISODE, FRAME].map(ints),
            sources: ints(SOURCE),
            done: batch[DONE].as_boolean().values(),
            success: batch[SUCCESS].as_boolean().values(),
        };
        (0..batch.num_rows()).try_for_each(|r| self.take(&columns, r))
    }

    fn check_column(&self, path: &Path, batch: &RecordBatch, feature: &Feature) -> Result<()> {
        let (name, width, task) = (feature.name.as_ref(), feature.width, &self.layout.name);
        let wrong = |what: String| Error::input(path, format!("column {name} {what}"));
        let column = batch.column_by_name(name).ok_or_else(|| wrong("is missing".into()))?;
        let expected = field(feature);
        if column.null_count() > 0 {
            return Err(wrong("has empty cells".into()));
        }
        if !expected.data_type().equals_datatype(column.data_type()) {
            return Err(wrong(format!("has type {}, {task} has {}", column.data_type(), expected.data_type())));
        }
        if feature.kind != Kind::F32 {
            return Ok(());
        }
        let values = if width == 1 { column } else { column.as_fixed_size_list().values() };
        check::finite(path, name, width, self.frames, values.as_primitive::<Float32Type>().values())
    }

    /// Adds a row to the episode that it belongs to.
    fn take(&mut self, batch: &Batch, r: usize) -> Result<()> {
        let now = &mut self.now;
        let frame = now.rewards.len();
        let found = batch.places.map(|column| column[r]);
        let expected = [self.frames, self.episodes, frame].map(|place| place as i64);
        if found != expected {
            let row = self.frames;
            let what = || format!("row {row} has [{INDEX}, {EPISODE}, {FRAME}] = {found:?}, expected {expected:?}");
            self.misplaced.get_or_insert_with(what);
        }
        let from = now.states.len();
        batch.state.iter().for_each(|(values, width)| now.states.extend(&values[r * width..(r + 1) * width]));
        if frame == 0 {
            now.source = batch.sources[r] as u64;
        } else if now.states[from..] != now.next {
            let (number, before) = (self.episodes, frame - 1);
            let what =
                || format!("episode {number}: next.observation of frame {before} is not the observation of the frame after it");
            self.wrong.get_or_insert_with(what);
        }
        now.next.clear();
        batch.next.iter().for_each(|(values, width)| now.next.extend(&values[r * width..(r + 1) * width]));
        let of_row = r * self.layout.action_dim()..(r + 1) * self.layout.action_dim();
        now.actions.extend(&batch.actions[of_row.clone()]);
        now.executed.extend(&batch.executed[of_row]);
        now.rewards.push(batch.rewards[r]);
        self.frames += 1;
        if batch.done.value(r) { self.end_episode(batch.success.value(r)) } else { Ok(()) }
    }

    fn end_episode(&mut self, success: bool) -> Result<()> {
        let Episode { states, next, actions, executed, rewards, source } = &mut self.now;
        states.append(next);
        // Copies as long as the episode, where what they are copied from has room for the longest.
        let seen = match Demo::new(&self.layout, states.as_slice().into(), actions.as_slice().into(), executed.as_slice().into())
        {
            Ok(demo) => (self.see)(DatasetEpisode { source_index: *source, demo, rewards: rewards.as_slice().into(), success }),
            Err(what) => {
                self.wrong.get_or_insert_with(|| format!("episode {}: {what}", self.episodes));
                Ok(())
            }
        };
        [states, actions, executed, rewards].into_iter().for_each(Vec::clear);
        self.episodes += 1;
        seen
    }

    /// Checks what holds of all rows together.
    pub(super) fn finish(self, root: &Path, info: &Info) -> Result<()> {
        let (frames, episodes) = (self.frames, self.episodes);
        let whole = self.now.rewards.is_empty();
        if frames == info.frames && episodes == info.episodes && !whole {
            return Err(Error::input(
                root,
                format!("its last frame ends no episode ({DONE} is false there): the rows are not in their order"),
            ));
        }
        if frames != info.frames || episodes != info.episodes || frames == 0 {
            let message = format!(
                "meta/info.json says {} episodes of {} frames, the data has {episodes} of {frames}",
                info.episodes, info.frames
            );
            return Err(Error::input(root, message));
        }
        self.misplaced.or(self.wrong).map_or(Ok(()), |what| Err(Error::input(root, what)))
    }
}
