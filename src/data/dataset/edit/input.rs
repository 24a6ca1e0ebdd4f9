//! A dataset that others are made of.

use crate::data::dataset::cells::Kind;
use crate::data::dataset::features::{EPISODE, FRAME, Feature, INDEX, SUCCESS, TASK, TIMESTAMP, features as own_features};
use crate::data::dataset::foreign::{Declared, Root, instructions, is_foreign, task_name};
use crate::data::dataset::{foreign, read};
use crate::data::{ContentHash, Provenance};
use crate::error::{Error, Result};
use crate::layout::Layout;
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

/// A dataset that has been looked at, whoever wrote it.
pub struct Input {
    pub(super) root: Root,
    /// What the rows of hilt's own hold, and where it came from.
    pub(super) own: Option<(Arc<Layout>, Provenance)>,
    /// Its columns of numbers, in the order of the files, those of hilt's own first.
    pub(super) features: Vec<Feature>,
    /// Its other columns, with their types.
    pub(super) others: Vec<Declared>,
    pub(super) instructions: Vec<String>,
    /// Of all files that were read.
    pub(super) content: ContentHash,
}

/// Columns that every dataset has, whatever it is made of, with their types.
pub(super) const USUAL: [(&str, Kind); 5] =
    [(TIMESTAMP, Kind::F32), (FRAME, Kind::I64), (EPISODE, Kind::I64), (INDEX, Kind::I64), (TASK, Kind::I64)];

impl Input {
    /// Looks at a dataset. All of hilt's own is checked against its seal.
    ///
    /// # Errors
    /// [`Error::Input`] with what is wrong with it, and what to do; [`Error::Io`].
    pub fn open(path: &Path) -> Result<Input> {
        let own = match is_foreign(path) {
            true => None,
            false => {
                let found = read::each(path, |_| Ok(()))?;
                Some((found.layout, found.provenance))
            }
        };
        let root = Root::open(path)?;
        let mut features: Vec<Feature> = own.iter().flat_map(|(layout, _)| own_features(layout)).collect();
        let mut others = Vec::new();
        for name in foreign::column_order(&root)? {
            let Some(column) = root.info.feature(&name) else { continue };
            let known = features.iter().any(|feature| *feature.name == *name);
            let usual = USUAL.iter().any(|(usual, _)| *usual == name);
            match column.kind() {
                _ if known || usual => {}
                Some(kind) => features.push(feature(column, kind)),
                None => others.push(column.clone()),
            }
        }
        others.extend(root.info.features.iter().filter(|column| column.dtype == "video").cloned());
        if own.is_none() {
            let usual = |(name, kind)| Feature { name: Cow::Borrowed(name), kind, width: 1, names: None, doc: "" };
            features.extend(USUAL.map(usual));
        }
        let instructions = instructions(path)?;
        let content = foreign::content(&root)?;
        Ok(Input { root, own, features, others, instructions, content })
    }

    /// Its number of episodes.
    pub fn episodes(&self) -> usize {
        self.root.episodes.len()
    }

    /// Frames of each episode.
    pub fn lengths(&self) -> impl Iterator<Item = usize> {
        self.root.episodes.iter().map(|episode| episode.length)
    }

    /// Its name: of its task, or of its directory.
    pub fn name(&self) -> String {
        self.own.as_ref().map_or_else(|| task_name(&self.root.path, &self.root.info), |(_, made)| made.task.clone())
    }

    /// Its tasks in words, in the order of their numbers. Without `meta/tasks.parquet` those that its episodes name, or its own name.
    pub(super) fn tasks(&self) -> Vec<String> {
        let of_episodes = self.root.episodes.iter().flat_map(|episode| &episode.tasks);
        let mut tasks = self.instructions.clone();
        for text in of_episodes.filter(|_| self.instructions.is_empty()) {
            if !tasks.contains(text) {
                tasks.push(text.clone());
            }
        }
        if tasks.is_empty() {
            tasks.push(self.name());
        }
        tasks
    }

    /// The names of its columns.
    pub fn columns(&self) -> impl Iterator<Item = &str> {
        self.features.iter().map(|feature| &*feature.name).chain(self.others.iter().map(|column| column.name.as_str()))
    }

    /// The columns that hilt cannot write, with their types.
    pub fn unwritable(&self) -> impl Iterator<Item = (&str, &str)> {
        self.others.iter().map(|column| (column.name.as_str(), column.dtype.as_str()))
    }

    /// Which episodes end in success, by the last frame of their column `next.success`.
    ///
    /// # Errors
    /// [`Error::Input`] without that column; what reading returns.
    pub fn successes(&self) -> Result<BTreeSet<usize>> {
        let has = self.root.info.feature(SUCCESS).is_some_and(|column| column.kind() == Some(Kind::Bool));
        if !has {
            let message = format!("has no column {SUCCESS} of true and false, by which an episode would succeed");
            return Err(Error::input(&self.root.path, message));
        }
        let mut found = BTreeSet::new();
        foreign::each(&self.root, &[(SUCCESS, Kind::Bool, 1)], &mut |frames| {
            if frames.cells[0].to_f64().last().is_some_and(|last| *last > 0.0) {
                found.insert(frames.number);
            }
            Ok(())
        })?;
        Ok(found)
    }

    /// Whether all that makes a dataset hilt's own is there without these columns.
    pub(super) fn stays_own(&self, dropped: &[String]) -> Option<&(Arc<Layout>, Provenance)> {
        let own = self.own.as_ref()?;
        let needed = own_features(&own.0);
        (!needed.iter().any(|feature| dropped.iter().any(|name| **name == *feature.name))).then_some(own)
    }
}

fn feature(column: &Declared, kind: Kind) -> Feature {
    Feature { name: column.name.clone().into(), kind, width: column.width(), names: column.names.clone(), doc: "" }
}
