//! The progress of learning: the updates of each part (pretraining, warm start, Algorithm 1), with the losses as they stand.

use super::{Console, Progress};
use crate::learn::{EpochMetrics, Metric};
use std::time::Instant;

/// Follows the epochs of one stage.
pub struct Epochs<'a> {
    console: &'a Console,
    running: Option<(String, Progress<'a>)>,
    /// When the running part began: its first report comes after its first epoch.
    began: Instant,
}

impl<'a> Epochs<'a> {
    /// Before the first epoch.
    pub fn new(console: &'a Console) -> Self {
        Epochs { console, running: None, began: Instant::now() }
    }

    /// One more epoch is done.
    pub fn step(&mut self, epoch: &EpochMetrics, metrics: &[Metric]) {
        if self.running.as_ref().is_none_or(|(part, _)| *part != epoch.stage) {
            self.finish();
            // Every epoch has as many updates as those so far.
            let of_epochs = |epochs: u64| epoch.updates * epochs / epoch.epoch;
            let progress = self.console.progress(&epoch.stage, of_epochs(epoch.epochs), "updates").since(self.began);
            self.running = Some((epoch.stage.clone(), progress.after(of_epochs(epoch.epoch - 1))));
        }
        if let Some((_, progress)) = &self.running {
            progress.reach(epoch.updates, &words(epoch, metrics));
        }
    }

    /// The part that runs is over.
    pub fn finish(&mut self) {
        if let Some((_, progress)) = self.running.take() {
            progress.finish("");
            self.began = Instant::now();
        }
    }
}

/// What is known of the epoch, in words; what was not computed is left out.
fn words(epoch: &EpochMetrics, metrics: &[Metric]) -> String {
    let labelled = metrics.iter().filter_map(|metric| metric.label.map(|label| (label, epoch.get(metric.name))));
    labelled.filter(|(_, value)| value.is_finite()).map(|(label, value)| format!(", {label} {value:.4}")).collect()
}
