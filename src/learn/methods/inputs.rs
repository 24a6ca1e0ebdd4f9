//! The demos that a method learns from.

use crate::demo::Demo;
use crate::error::{Error, Result};
use crate::layout::Layout;
use crate::learn::models::Corpus;
use std::borrow::Cow;

/// Training and validation demos of one task.
pub struct Inputs {
    /// What is learned from.
    pub train: Corpus,
    /// What it is judged on.
    pub validation: Corpus,
}

impl Inputs {
    /// Takes the demos.
    ///
    /// # Errors
    /// [`Error::Failed`] without demos or when layouts differ.
    pub fn new<'a>(train: impl Into<Cow<'a, [Demo]>>, validation: impl Into<Cow<'a, [Demo]>>) -> Result<Self> {
        let inputs = Inputs { train: Corpus::new(train, "training")?, validation: Corpus::new(validation, "validation")? };
        inputs.same_layout(Some(&inputs.validation.layout))?;
        Ok(inputs)
    }

    /// Refuses another layout than that of the training demos.
    ///
    /// # Errors
    /// [`Error::Failed`] with both.
    pub fn same_layout(&self, other: Option<&Layout>) -> Result<()> {
        let ours = &*self.train.layout;
        let Some(theirs) = other.filter(|theirs| *theirs != ours) else { return Ok(()) };
        let words = |layout: &Layout| format!("{} (states of {} numbers)", layout.name, layout.state_dim());
        let same = if ours.name == theirs.name { ", of another robot or in another order" } else { "" };
        let (ours, theirs) = (words(ours), words(theirs));
        Err(Error::Failed(format!(
            "the training demos are of {ours}, but validation demos or dynamics network of {theirs}{same}"
        )))
    }
}
