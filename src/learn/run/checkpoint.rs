//! The state of training at the end of an epoch as named arrays and a description, and back: with it training goes on as if it had
//! never stopped. Floats of the networks are arrays; counts and metrics, which f32 cannot hold, go into the description.

use super::history::History;
use super::method::{Method, Saved};
use super::metrics::EpochMetrics;
use super::past;
use crate::learn::models::{Policy, Reader};
use crate::tensor::NamedTensor;
use serde_json::{Value, json};

/// What training needs to go on after an epoch, beside demos, dynamics network, settings and seed.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// All arrays.
    pub tensors: Vec<NamedTensor>,
    /// All that is not an array; its entry `after` says in words where training stands.
    pub meta: Value,
}

/// What the names of the preferred policy's tensors begin with.
const BEST: &str = "best.";

impl Checkpoint {
    /// Of a method's state and the run so far.
    pub fn new(saved: &Saved, history: &History) -> Self {
        let mut tensors = saved.tensors.clone();
        let best = history.best.iter().flat_map(Policy::to_tensors);
        tensors.extend(best.map(|tensor| NamedTensor { name: format!("{BEST}{}", tensor.name), ..tensor }));
        let History { rows, selection, .. } = history;
        let after = rows.last().map(EpochMetrics::place).unwrap_or_default();
        Checkpoint { tensors, meta: json!({ "after": after, "counts": saved.counts, "selection": selection, "epochs": rows }) }
    }

    /// Where training stands, in words: "hil epoch 3 of 60".
    pub fn after(&self) -> &str {
        self.meta.get("after").and_then(Value::as_str).unwrap_or("an unknown epoch")
    }

    /// What was known after each epoch so far.
    ///
    /// # Errors
    /// Says what of the description is missing or does not fit.
    pub fn rows(&self) -> Result<Vec<EpochMetrics>, String> {
        Reader { tensors: &self.tensors, meta: &self.meta }.meta("epochs")
    }

    /// Puts a fresh method of the same run into the state; what else the run knows comes back.
    ///
    /// # Errors
    /// Says what is missing or does not fit.
    pub fn restore(&self, method: &mut dyn Method) -> Result<History, String> {
        let reader = Reader { tensors: &self.tensors, meta: &self.meta };
        let mut history = History { rows: reader.meta("epochs")?, selection: reader.meta("selection")?, best: None };
        past::check(&history, &method.stages())?;
        method.restore(&reader.meta("counts")?, &reader, &history.rows)?;
        if history.selection.best().is_some() {
            let best = |tensor: &NamedTensor| {
                let name = tensor.name.strip_prefix(BEST)?;
                Some(NamedTensor { name: name.into(), ..tensor.clone() })
            };
            let best: Vec<NamedTensor> = self.tensors.iter().filter_map(best).collect();
            history.best = Some(Policy::from_tensors(&best, &method.candidate().meta())?);
        }
        Ok(history)
    }
}
