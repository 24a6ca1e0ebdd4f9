//! The finished runs as a table.

use super::finished::{Finished, Measured};
use crate::data::Provenance;
use crate::table::{Table, Values};
use crate::tasks::FailureClass;
use serde_json::json;

/// A row a run of a task, and where it came from.
pub fn run_table(finished: &Finished, task: &str) -> (Table, Provenance) {
    let runs: Vec<&Measured> = finished.runs.iter().filter(|m| m.run.task == task).collect();
    let texts = |pick: &dyn Fn(&Measured) -> String| Values::Text(runs.iter().map(|m| pick(m)).collect());
    let counts = |pick: &dyn Fn(&Measured) -> u64| Values::I64(runs.iter().map(|m| pick(m) as i64).collect());
    let numbers = |pick: &dyn Fn(&Measured) -> f64| Values::F64(runs.iter().map(|m| pick(m)).collect());
    let mut table = Table::default()
        .with("preset", "Preset of the settings", texts(&|m| m.run.preset.clone()))
        .with("variation", "Variation, empty for the plain settings", texts(&|m| m.run.variation.clone()))
        .with("method", "Method", texts(&|m| m.run.method.name().into()))
        .with("seed", "Seed of demos, training and evaluation", counts(&|m| m.run.seed))
        .with("episodes", "Episodes of the evaluation", counts(&|m| m.summary.episodes))
        .with("successes", "Episodes that were solved", counts(&|m| m.summary.successes))
        .with("success_rate", "Their share", numbers(&|m| m.summary.success_rate))
        .with("wilson_95_low", "Low end of the Wilson 95 % interval", numbers(&|m| m.summary.wilson_95[0]))
        .with("wilson_95_high", "High end of the Wilson 95 % interval", numbers(&|m| m.summary.wilson_95[1]))
        .with("updates", "Updates of the policy, warm start included", counts(&|m| m.updates))
        .with("epochs", "Epochs of training, warm start included", counts(&|m| m.metrics.rows() as u64))
        .with(
            "train_s",
            "Wall time of training by its log, NaN where there is none",
            numbers(&|m| m.train_s.unwrap_or(f64::NAN)),
        );
    table = table.with(
        "train_processor_s",
        "Processor time of training by its log, NaN where there is none",
        numbers(&|m| m.train_processor_s.unwrap_or(f64::NAN)),
    );
    for class in FailureClass::ALL {
        let count = counts(&|m| m.summary.failures.get(class.name()).copied().unwrap_or(0));
        table = table.with(&format!("failure.{}", class.name()), &format!("Failed episodes: {}", class.words()), count);
    }
    let settings = json!({ "experiment": finished.experiment.name, "runs": runs.len() });
    let mut provenance = Provenance::new("report", task, settings, 0);
    for measured in &runs {
        if let Some(content) = &measured.content {
            let id = finished.grid.steps[measured.run.evaluate].id.clone();
            provenance = provenance.with_input(&id, content);
        }
    }
    (table, provenance)
}
