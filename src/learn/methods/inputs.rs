//! The demos that a method learns from.

use crate::demo::Demo;
use crate::error::{Error, Result};
use crate::learn::models::Corpus;
use crate::task::Task;
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
    /// [`Error::Failed`] without demos or when tasks differ.
    pub fn new<'a>(train: impl Into<Cow<'a, [Demo]>>, validation: impl Into<Cow<'a, [Demo]>>) -> Result<Self> {
        let inputs = Inputs { train: Corpus::new(train, "training")?, validation: Corpus::new(validation, "validation")? };
        inputs.same_task(Some(inputs.validation.task))?;
        Ok(inputs)
    }

    /// Refuses another task than that of the training demos.
    ///
    /// # Errors
    /// [`Error::Failed`] with both tasks.
    pub fn same_task(&self, other: Option<Task>) -> Result<()> {
        let task = self.train.task;
        match other.filter(|other| *other != task) {
            None => Ok(()),
            Some(other) => Err(Error::Failed(format!(
                "the training demos are of {task} (states of {} numbers), but validation demos or dynamics network of {other} ({})",
                task.state_dim(),
                other.state_dim()
            ))),
        }
    }
}
