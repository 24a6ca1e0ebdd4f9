//! The rows of all data files, one episode after the other, in the memory of one episode and one batch.

use super::flat;
use super::{Info, Root};
use crate::data::ContentHash;
use crate::data::dataset::cells::{Cells, Kind};
use crate::data::dataset::features::{EPISODE, FRAME, INDEX};
use crate::data::parquet_stream::Stream;
use crate::error::{Error, Result};
use arrow_array::RecordBatch;
use std::collections::BTreeMap;
use std::path::Path;

/// The columns that say where a row belongs.
const PLACES: [&str; 3] = [INDEX, EPISODE, FRAME];

/// A column that is read: its name, the type of its numbers, and how many a row has.
pub(in crate::data::dataset) type Wanted<'a> = (&'a str, Kind, usize);

/// The frames of an episode.
pub(in crate::data::dataset) struct Frames {
    /// Its number.
    pub(in crate::data::dataset) number: usize,
    /// Number of its first frame.
    pub(in crate::data::dataset) first: usize,
    /// Its frames.
    pub(in crate::data::dataset) length: usize,
    /// Of each wanted column.
    pub(in crate::data::dataset) cells: Vec<Cells>,
}

/// What is shown the episodes.
type See<'a> = dyn FnMut(Frames) -> Result<()> + 'a;

/// Shows `see` the `wanted` columns of every episode, in order; returns the hashes of the files by their paths below the root.
///
/// # Errors
/// [`Error::Input`] with the file, the column and the row at fault; what `see` returns.
pub(in crate::data::dataset) fn each(root: &Root, wanted: &[Wanted], see: &mut See) -> Result<BTreeMap<String, ContentHash>> {
    let mut hashes = BTreeMap::new();
    let mut reading = Reading { root, wanted, see, rows: 0, episode: 0, frame: 0, cells: begun(wanted) };
    for name in root.data_files() {
        if hashes.contains_key(&name) {
            let message =
                format!("meta/episodes has episodes of {name} before and after those of another file; put them into their order");
            return Err(Error::input(&root.path, message));
        }
        let path = root.path.join(&name);
        if !path.is_file() {
            return Err(Error::input(&path, "is missing, but meta/episodes has episodes in it; fetch it again, or remove them"));
        }
        let stream = Stream::open_any(&path)?;
        reading.check_columns(&path, &stream)?;
        let columns: Vec<&str> = wanted.iter().map(|(name, ..)| *name).chain(PLACES).collect();
        for batch in stream.columns(&path, &columns)? {
            reading.take(&path, &batch?)?;
        }
        hashes.insert(name, stream.content);
    }
    reading.finish()?;
    Ok(hashes)
}

fn begun(wanted: &[Wanted]) -> Vec<Cells> {
    wanted.iter().map(|(_, kind, _)| flat::none_of(*kind)).collect()
}

/// What has been read of the rows.
struct Reading<'a> {
    root: &'a Root,
    wanted: &'a [Wanted<'a>],
    see: &'a mut See<'a>,
    /// Rows that came before.
    rows: usize,
    /// The episode that the next row belongs to, and its place there.
    episode: usize,
    frame: usize,
    cells: Vec<Cells>,
}

impl Reading<'_> {
    fn check_columns(&self, path: &Path, stream: &Stream) -> Result<()> {
        let missing = |name: &&str| stream.schema().column_with_name(name).is_none();
        match self.wanted.iter().map(|(name, ..)| *name).chain(PLACES).find(missing) {
            None => Ok(()),
            Some(name) if PLACES.contains(&name) => {
                Err(Error::input(path, format!("has no column {name}, which says where a row belongs")))
            }
            Some(name) => Err(Error::input(path, format!("has no column {name}, which meta/info.json declares"))),
        }
    }

    /// The numbers of a column of a batch.
    fn numbers(&self, path: &Path, batch: &RecordBatch, (name, kind, width): Wanted) -> Result<Cells> {
        let mut cells = flat::none_of(kind);
        flat::append(&batch[name], width, &mut cells).map_err(|(row, what)| {
            let row = row.map_or_else(String::new, |row| format!(", row {}", self.rows + row));
            Error::input(path, format!("column {name}{row}: {what}"))
        })?;
        Ok(cells)
    }

    fn take(&mut self, path: &Path, batch: &RecordBatch) -> Result<()> {
        let columns = self.wanted.iter().map(|wanted| self.numbers(path, batch, *wanted)).collect::<Result<Vec<_>>>()?;
        let mut places: [Vec<i64>; 3] = Default::default();
        for (name, to) in PLACES.iter().zip(&mut places) {
            if let Cells::I64(values) = self.numbers(path, batch, (name, Kind::I64, 1))? {
                *to = values;
            }
        }
        let mut at = 0;
        while at < batch.num_rows() {
            let Some(length) = self.root.episodes.get(self.episode).map(|episode| episode.length) else {
                let message = format!("has rows after the {} frames of all episodes in meta/episodes; remove them", self.rows);
                return Err(Error::input(path, message));
            };
            let to = batch.num_rows().min(at + length - self.frame);
            let [index, episode, frame] = places.each_ref().map(|values| &values[at..to]);
            for ((index, episode), frame) in index.iter().zip(episode).zip(frame) {
                self.check_place(path, [*index, *episode, *frame])?;
                (self.rows, self.frame) = (self.rows + 1, self.frame + 1);
            }
            for ((cells, column), (_, _, width)) in self.cells.iter_mut().zip(&columns).zip(self.wanted) {
                cells.extend_from(column, at * width..to * width);
            }
            at = to;
            if self.frame == length {
                self.end()?;
            }
        }
        Ok(())
    }

    fn check_place(&self, path: &Path, found: [i64; 3]) -> Result<()> {
        let expected = [self.rows, self.episode, self.frame].map(|place| place as i64);
        if found == expected {
            return Ok(());
        }
        let names = PLACES.join(", ");
        let what = if found[1] == expected[1] {
            "frames are numbered without a gap, in their order".into()
        } else {
            // A row too many of the one before, or one too few.
            let at = if found[1] < expected[1] && self.frame == 0 { self.episode.saturating_sub(1) } else { self.episode };
            format!("meta/episodes says that episode {at} has {} frames", self.root.episodes[at].length)
        };
        Err(Error::input(path, format!("row {} has [{names}] = {found:?}, expected {expected:?}: {what}", self.rows)))
    }

    fn end(&mut self) -> Result<()> {
        let cells = std::mem::replace(&mut self.cells, begun(self.wanted));
        let frames = Frames { number: self.episode, first: self.rows - self.frame, length: self.frame, cells };
        (self.episode, self.frame) = (self.episode + 1, 0);
        (self.see)(frames)
    }

    fn finish(self) -> Result<()> {
        let Info { frames, episodes, .. } = self.root.info;
        if self.rows == frames {
            return Ok(());
        }
        let message = format!(
            "meta/info.json and meta/episodes say {episodes} episodes of {frames} frames, the data files have {} frames: fetch what is \
             missing, or remove the episodes that are not there",
            self.rows
        );
        Err(Error::input(&self.root.path, message))
    }
}
