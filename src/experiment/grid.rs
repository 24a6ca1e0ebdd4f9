//! From an experiment to its runs and the steps that they share.

use super::builder::{At, Builder};
use super::resolve::cells;
use super::runs::{Grid, Run};
use super::spec::{Experiment, Variation};
use crate::error::{Error, Result};
use std::collections::HashMap;
use std::path::Path;

/// More runs than one machine does in a year.
const MOST_RUNS: usize = 100_000;

impl Grid {
    /// The runs of an experiment whose files go below `dir`.
    ///
    /// # Errors
    /// [`Error::Usage`] for settings that do not exist, a grid that is too large, and variations or presets that come to the same run.
    pub fn expand(experiment: &Experiment, dir: &Path) -> Result<Self> {
        let variations = choices(experiment);
        let of_a_seed = experiment.tasks.len() * experiment.presets.len() * variations.len() * experiment.methods.len();
        if of_a_seed.saturating_mul(experiment.seeds.len()) > MOST_RUNS {
            let (file, seeds) = (experiment.path.display(), experiment.seeds.len());
            return Err(Error::Usage(format!("{file}: {of_a_seed} x {seeds} runs; allowed: up to {MOST_RUNS}")));
        }
        let mut resolved = Vec::new();
        for (t, task) in experiment.tasks.iter().enumerate() {
            for (p, preset) in experiment.presets.iter().enumerate() {
                let plain = cells(experiment, task, preset, None)?;
                for (v, variation) in variations.iter().enumerate() {
                    if variation.is_some_and(|v| !v.tasks.contains(task)) {
                        continue;
                    }
                    let varied = cells(experiment, task, preset, *variation)?;
                    for (m, (settings, base)) in varied.into_iter().zip(&plain).enumerate() {
                        if variation.is_none_or(|v| v.methods.contains(&experiment.methods[m])) {
                            resolved.push(([t, p, v, m], settings, base.clone()));
                        }
                    }
                }
            }
        }
        let mut builder = Builder::new(experiment, dir);
        let mut runs = Vec::new();
        for (s, seed) in experiment.seeds.iter().enumerate() {
            for ([t, p, v, m], settings, base) in &resolved {
                let (task, preset) = (&experiment.tasks[*t], &experiment.presets[*p]);
                let at = At { task, preset, variation: variations[*v], seed: *seed };
                runs.push(([*t, *p, *v, *m, s], builder.run(&at, experiment.methods[*m], settings, base)?));
            }
        }
        runs.sort_by_key(|(order, _)| *order);
        let runs: Vec<Run> = runs.into_iter().map(|(_, run)| run).collect();
        if runs.is_empty() {
            let file = experiment.path.display();
            return Err(Error::Usage(format!("{file}: no variation has any of its tasks and methods: there is nothing to run")));
        }
        check_apart(experiment, &runs)?;
        Ok(Grid { steps: builder.steps, runs })
    }
}

/// The variations; one without a name where there are none.
fn choices(experiment: &Experiment) -> Vec<Option<&Variation>> {
    if experiment.variations.is_empty() { vec![None] } else { experiment.variations.iter().map(Some).collect() }
}

/// No two runs may be the same one.
fn check_apart(experiment: &Experiment, runs: &[Run]) -> Result<()> {
    let mut first: HashMap<usize, &Run> = HashMap::new();
    for run in runs {
        if let Some(other) = first.insert(run.evaluate, run) {
            let (file, task, method) = (experiment.path.display(), &run.task, run.method.name());
            let (a, b) = if other.variation == run.variation {
                (format!("presets \"{}\"", other.preset), format!("\"{}\"", run.preset))
            } else {
                (format!("variations \"{}\"", other.variation), format!("\"{}\"", run.variation))
            };
            return Err(Error::Usage(format!("{file}: {a} and {b} come to the same settings of {task}, {method}: remove one")));
        }
    }
    Ok(())
}
