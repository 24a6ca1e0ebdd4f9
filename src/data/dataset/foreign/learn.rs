//! A dataset of another program as demos to learn from.

use super::columns::{Choice, Columns};
use super::frames::{self, Frames, Wanted};
use super::{Declared, Root, task_name};
use crate::data::ContentHash;
use crate::data::dataset::cells::{Cells, Kind};
use crate::data::dataset::meta::{TRAIN, VALIDATION};
use crate::data::dataset::{foreign, split};
use crate::demo::{Demo, LARGEST_NUMBER};
use crate::error::{Error, Result};
use crate::layout::Layout;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A dataset that can be learned from, of which description and episodes have been read, the frames not yet.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// What the rows hold.
    pub layout: Arc<Layout>,
    /// Columns of pictures, which are skipped.
    pub pictures: Vec<String>,
    /// One root, or one for training and one for validation.
    roots: Vec<Root>,
    columns: Columns,
}

/// The demos of a dataset.
pub struct Read {
    /// What is learned from.
    pub train: Vec<Demo>,
    /// What it is judged on.
    pub validation: Vec<Demo>,
    /// The content of the files that were read.
    pub content: ContentHash,
}

/// Looks at the dataset in `dir`, or at the two datasets `train` and `validation` in it.
///
/// # Errors
/// [`Error::Input`] with what is wrong or lacking, and what to do.
pub fn open(dir: &Path, choice: &Choice) -> Result<Source> {
    let paths: Vec<PathBuf> = match dir.join(foreign::INFO).is_file() {
        true => vec![dir.into()],
        false => [TRAIN, VALIDATION].map(|name| dir.join(name)).into(),
    };
    if paths.len() > 1 && !paths[1].exists() {
        let message = format!("holds {TRAIN} but no {VALIDATION}; name {} itself, and it is split", paths[0].display());
        return Err(Error::input(dir, message));
    }
    let roots = paths.iter().map(|path| Root::open(path)).collect::<Result<Vec<_>>>()?;
    let first = &roots[0];
    let columns = Columns::of(&first.info, choice).map_err(|why| Error::input(&first.path, why))?;
    let name = task_name(dir, &first.info);
    let layout_of = |root: &Root| -> Result<Arc<Layout>> {
        let columns = Columns::of(&root.info, choice).map_err(|why| Error::input(&root.path, why))?;
        columns.layout(&name, root.info.fps).map_err(|why| Error::input(&root.path, why))
    };
    let layout = layout_of(first)?;
    for other in &roots[1..] {
        if layout_of(other)? != layout {
            let message = format!("has other columns or another rate than {}", first.path.display());
            return Err(Error::input(&other.path, message));
        }
    }
    Ok(Source { layout, pictures: columns.pictures.clone(), columns, roots })
}

impl Source {
    /// Reads the demos. One root is split by episode, `train_per_validation` to one, as [`split()`] does with `seed`.
    ///
    /// # Errors
    /// [`Error::Input`] with the file, the column and the row at fault, or when an episode is too short or no second one is there.
    pub fn read(&self, train_per_validation: u32, seed: u64) -> Result<Read> {
        let mut files = BTreeMap::new();
        let mut demos = Vec::new();
        for root in &self.roots {
            let folder = if self.roots.len() == 1 {
                ""
            } else if demos.is_empty() {
                TRAIN
            } else {
                VALIDATION
            };
            let (found, hashes) = self.demos(root)?;
            let path = |name: &str| Path::new(folder).join(name).display().to_string();
            files.insert(path(foreign::INFO), root.info.hash);
            files.extend(hashes.iter().map(|(name, hash)| (path(name), *hash)));
            demos.push(found);
        }
        let content = ContentHash::of_directory(files.iter().map(|(name, hash)| (name.as_str(), *hash)));
        let first = demos.remove(0);
        let (train, validation) = match demos.pop() {
            Some(validation) => (first, validation),
            None => divided(&self.roots[0].path, first, train_per_validation, seed)?,
        };
        Ok(Read { train, validation, content })
    }

    /// Shows `see` state and action of every frame of all roots, whatever their numbers are.
    ///
    /// # Errors
    /// As [`Source::read`], but for numbers.
    pub fn each_row(&self, see: &mut dyn FnMut(&[f32], &[f32])) -> Result<()> {
        let Columns { state, action, .. } = &self.columns;
        let wanted: Vec<Wanted> = state.iter().chain([action]).map(wanted).collect();
        let mut row = Vec::with_capacity(self.layout.state_dim());
        for root in &self.roots {
            frames::each(root, &wanted, &mut |frames| {
                let columns = f32_columns(&frames);
                for t in 0..frames.length {
                    row.clear();
                    let part = |i: usize| &columns[i][t * wanted[i].2..(t + 1) * wanted[i].2];
                    (0..state.len()).for_each(|i| row.extend_from_slice(part(i)));
                    see(&row, part(state.len()));
                }
                Ok(())
            })?;
        }
        Ok(())
    }

    fn demos(&self, root: &Root) -> Result<(Vec<Demo>, BTreeMap<String, ContentHash>)> {
        let Columns { state, next, action, executed, .. } = &self.columns;
        let columns = state.iter().chain([action]).chain(next.iter().flatten()).chain(executed);
        let wanted: Vec<Wanted> = columns.map(wanted).collect();
        let mut demos = Vec::with_capacity(root.episodes.len());
        let hashes = frames::each(root, &wanted, &mut |frames| {
            demos.push(self.demo(root, &wanted, &frames)?);
            Ok(())
        })?;
        Ok((demos, hashes))
    }

    /// T frames have T - 1 transitions, or T where the states after the actions are there too.
    fn demo(&self, root: &Root, wanted: &[Wanted], frames: &Frames) -> Result<Demo> {
        let columns = f32_columns(frames);
        for ((name, _, width), values) in wanted.iter().zip(&columns) {
            if let Some(at) = values.iter().position(|v| !v.is_finite() || f64::from(v.abs()) > LARGEST_NUMBER) {
                return Err(self.refused(root, frames, name, (at / width, at % width, values[at])));
            }
        }
        let (states, length) = (self.columns.state.len(), frames.length);
        let has_next = self.columns.next.is_some();
        let steps = if has_next { length } else { length - 1 };
        if steps == 0 {
            let message = format!(
                "episode {} has one frame, and no next.observation.state says what follows: no transition; drop it (hilt dataset drop \
                 --episodes {0})",
                frames.number
            );
            return Err(Error::input(&root.path, message));
        }
        let mut all = Vec::with_capacity((steps + 1) * self.layout.state_dim());
        let mut push = |from: usize, t: usize| {
            for i in from..from + states {
                let width = wanted[i].2;
                all.extend_from_slice(&columns[i][t * width..(t + 1) * width]);
            }
        };
        (0..length).for_each(|t| push(0, t));
        if has_next {
            push(states + 1, length - 1);
        }
        let dim = self.layout.action_dim();
        let actions = columns[states][..steps * dim].to_vec();
        let executed =
            if self.columns.executed.is_some() { columns[columns.len() - 1][..steps * dim].to_vec() } else { actions.clone() };
        Demo::new(&self.layout, all, actions, executed)
            .map_err(|why| Error::input(&root.path, format!("episode {}: {why}", frames.number)))
    }

    fn refused(&self, root: &Root, frames: &Frames, name: &str, (row, entry, value): (usize, usize, f32)) -> Error {
        let what = match value.is_finite() {
            false => "not a finite number; drop its episode or mend it".to_string(),
            true => format!("larger than {LARGEST_NUMBER:e}, more than learning can square; give it in another unit"),
        };
        let (place, number) = (frames.first + row, frames.number);
        Error::input(
            &root.path,
            format!("column {name}, row {place} (episode {number}, frame {row}), entry {entry}: {value} is {what}"),
        )
    }
}

/// Read as f32, whatever its type is.
fn wanted(column: &Declared) -> Wanted<'_> {
    (&column.name, Kind::F32, column.width())
}

/// The numbers of columns that were read by [`wanted`].
fn f32_columns(frames: &Frames) -> Vec<&[f32]> {
    frames
        .cells
        .iter()
        .map(|cells| match cells {
            Cells::F32(values) => values.as_slice(),
            _ => unreachable!("they are read as f32"),
        })
        .collect()
}

/// Training and validation demos of one root.
fn divided(root: &Path, demos: Vec<Demo>, train_per_validation: u32, seed: u64) -> Result<(Vec<Demo>, Vec<Demo>)> {
    if demos.len() < 2 {
        return Err(Error::input(root, "has one episode; two are needed, one to learn from and one to judge by"));
    }
    let (_, validation) = split(demos.len(), train_per_validation, seed);
    let (mut train, mut held_out) = (Vec::new(), Vec::new());
    for (at, demo) in demos.into_iter().enumerate() {
        if validation.binary_search(&at).is_ok() { held_out.push(demo) } else { train.push(demo) }
    }
    Ok((train, held_out))
}
