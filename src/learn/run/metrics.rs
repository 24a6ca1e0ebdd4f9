//! What is known after each epoch of learning, and the table of all epochs.

use super::exact;
use crate::table::{Table, Values};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A number that is reported for each epoch.
#[derive(Clone, Copy, Debug)]
pub struct Metric {
    /// Name of its column.
    pub name: &'static str,
    /// What it is, with its unit.
    pub doc: &'static str,
    /// What a terminal calls it while training runs; `None` = it is in the table only.
    pub label: Option<&'static str>,
}

impl Metric {
    /// In the table, and on a terminal by this label.
    pub const fn shown(name: &'static str, label: &'static str, doc: &'static str) -> Metric {
        Metric { name, doc, label: Some(label) }
    }

    /// In the table only.
    pub const fn column(name: &'static str, doc: &'static str) -> Metric {
        Metric { name, doc, label: None }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
struct Exact(#[serde(with = "exact")] f64);

/// One epoch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EpochMetrics {
    /// Name of the stage.
    pub stage: String,
    /// Epoch of the stage, from 1.
    pub epoch: u64,
    /// Epochs of the stage.
    pub epochs: u64,
    /// Updates of the stage so far.
    pub updates: u64,
    values: BTreeMap<String, Exact>,
}

impl EpochMetrics {
    /// Nothing known yet.
    pub fn new(stage: &str, epoch: u64, epochs: u64) -> Self {
        EpochMetrics { stage: stage.into(), epoch, epochs, updates: 0, values: BTreeMap::new() }
    }

    /// Where training stands after the epoch: "hil epoch 3 of 60".
    pub fn place(&self) -> String {
        format!("{} epoch {} of {}", self.stage, self.epoch, self.epochs)
    }

    /// The number of this name; NaN where it was not computed.
    pub fn get(&self, name: &str) -> f64 {
        self.values.get(name).map_or(f64::NAN, |value| value.0)
    }

    /// Reports a number.
    pub fn set(&mut self, name: &str, value: f64) {
        self.values.insert(name.into(), Exact(value));
    }
}

/// One row an epoch, a column for each of `metrics`.
pub fn table(epochs: &[EpochMetrics], metrics: &[Metric]) -> Table {
    let integers = |pick: fn(&EpochMetrics) -> u64| Values::I64(epochs.iter().map(|m| pick(m) as i64).collect());
    let stages = Values::Text(epochs.iter().map(|m| m.stage.clone()).collect());
    let mut table = Table::default()
        .with("stage", "pretrain (Algorithm 4), warm-start (behavior cloning alone), hil (Algorithm 1), ppo or bc-rl", stages)
        .with("epoch", "Epoch of the stage, from 1", integers(|m| m.epoch))
        .with("updates", "Updates of the stage so far", integers(|m| m.updates));
    for Metric { name, doc, .. } in metrics {
        table = table.with(name, doc, Values::F64(epochs.iter().map(|m| m.get(name)).collect()));
    }
    table
}

/// Mean over the updates of an epoch.
#[derive(Clone, Copy, Debug, Default)]
pub struct Mean {
    sum: f64,
    count: u64,
}

impl Mean {
    /// Takes in a value.
    pub fn add(&mut self, value: f64) {
        self.sum += value;
        self.count += 1;
    }

    /// NaN when nothing was added.
    pub fn get(&self) -> f64 {
        self.sum / self.count as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_not_computed_is_nan_and_every_bit_survives_json() {
        let mut row = EpochMetrics::new("hil", 3, 60);
        row.set("l_bc", 0.1);
        row.set("l_sc", f64::NEG_INFINITY);
        let back: EpochMetrics = serde_json::from_str(&serde_json::to_string(&row).expect("text")).expect("a row");
        assert_eq!((back.get("l_bc"), back.get("l_sc"), back.place()), (0.1, f64::NEG_INFINITY, "hil epoch 3 of 60".into()));
        assert!(back.get("l_mix").is_nan());
    }
}
