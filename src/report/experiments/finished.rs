//! What is finished of an experiment, and its runs in groups.

use crate::data::ContentHash;
use crate::error::Result;
use crate::eval::{Summary, wilson_95};
use crate::experiment::estimate::{processor_s_of, wall_s_of};
use crate::experiment::results::{self, Row};
use crate::experiment::state::{Contents, survey};
use crate::experiment::{Experiment, Grid, Run};
use crate::learn::MethodName;
use crate::report::statistics::{self, Estimate, Score, Strata};
use crate::table::Table;

/// An experiment with the runs of it that are finished.
pub struct Finished {
    /// Its file.
    pub experiment: Experiment,
    /// Its steps and runs, finished or not.
    pub grid: Grid,
    /// What is there of each step.
    pub contents: Contents,
    /// The finished runs, in the order of its file.
    pub runs: Vec<Measured>,
}

/// A finished run.
pub struct Measured {
    /// The run.
    pub run: Run,
    /// Its evaluation.
    pub summary: Summary,
    /// Updates of its policy.
    pub updates: u64,
    /// What was known after each epoch of its training.
    pub metrics: Table,
    /// Wall time of its training, by its log \[s\].
    pub train_s: Option<f64>,
    /// Processor time of its training, by its log \[s\]; logs of older versions have none.
    pub train_processor_s: Option<f64>,
    /// The evaluation's content.
    pub content: Option<ContentHash>,
}

/// What runs have in common that differ in task and seed only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Arm<'a> {
    /// The preset.
    pub preset: &'a str,
    /// The variation; empty = the plain settings.
    pub variation: &'a str,
    /// The method.
    pub method: MethodName,
}

impl Finished {
    /// Looks at what is there and reads it.
    ///
    /// # Errors
    /// As [`survey`] and [`results::rows`].
    pub fn read(experiment: Experiment, grid: Grid) -> Result<Self> {
        let contents = survey(&grid)?;
        let measured = |Row { run, summary, updates, metrics }: Row| Measured {
            run: run.clone(),
            summary,
            updates,
            metrics,
            train_s: wall_s_of(&grid.steps[run.train].log),
            train_processor_s: processor_s_of(&grid.steps[run.train].log),
            content: contents[run.evaluate],
        };
        let runs = results::rows(&grid, &contents)?.into_iter().map(measured).collect();
        Ok(Finished { experiment, grid, contents, runs })
    }

    /// The arms that have a finished run, in the order of the file.
    pub fn arms(&self) -> Vec<Arm<'_>> {
        self.runs.iter().map(|measured| Arm::of(&measured.run)).fold(Vec::new(), |mut seen, arm| {
            if !seen.contains(&arm) {
                seen.push(arm);
            }
            seen
        })
    }

    /// Names of the tasks that have a finished run, in the order of the file.
    pub fn tasks(&self) -> Vec<&str> {
        let has_run = |task: &&str| self.runs.iter().any(|measured| measured.run.task == *task);
        self.experiment.tasks.iter().map(String::as_str).filter(has_run).collect()
    }

    /// The finished runs of an arm and a task, a seed each.
    pub fn of<'a>(&'a self, arm: Arm<'a>, task: &'a str) -> impl Iterator<Item = &'a Measured> + Clone {
        self.runs.iter().filter(move |measured| measured.run.task == task && Arm::of(&measured.run) == arm)
    }

    /// Success of each seed.
    pub fn scores(&self, arm: Arm, task: &str) -> Vec<Score> {
        self.of(arm, task).map(|m| Score { seed: m.run.seed, value: m.summary.success_rate }).collect()
    }

    /// The same without the seeds.
    pub fn singles(&self, arm: Arm, task: &str) -> Vec<f64> {
        self.of(arm, task).map(|m| m.summary.success_rate).collect()
    }

    /// Success of each seed of each task, an empty list for a task without one.
    pub fn strata(&self, arm: Arm, tasks: &[&str]) -> Strata {
        tasks.iter().map(|task| self.scores(arm, task)).collect()
    }

    /// Success of an arm on a task: over seeds the mean and its interval; of one seed its policy's Wilson interval.
    pub fn success(&self, arm: Arm, task: &str) -> Option<Estimate> {
        let runs: Vec<&Measured> = self.of(arm, task).collect();
        match runs.as_slice() {
            [] => None,
            [one] => {
                let Summary { success_rate: value, successes, episodes, .. } = one.summary;
                Some(Estimate { value, interval: wilson_95(successes, episodes) })
            }
            _ => Some(statistics::mean(&vec![self.scores(arm, task)])),
        }
    }

    /// Mean time of the trainings of an arm and a task \[s\]: wall or processor time, as `of` has it; `None` where a log lacks it.
    pub fn train_s(&self, arm: Arm, task: &str, of: fn(&Measured) -> Option<f64>) -> Option<f64> {
        let times: Vec<f64> = self.of(arm, task).map(of).collect::<Option<_>>()?;
        (!times.is_empty()).then(|| statistics::average(&times))
    }

    /// An arm as this experiment has to name it: by what differs among its arms.
    pub fn label(&self, arm: Arm) -> String {
        let Experiment { presets, methods, variations, .. } = &self.experiment;
        let mut words = Vec::new();
        words.extend((!variations.is_empty()).then_some(arm.variation));
        words.extend((methods.len() > 1 || variations.is_empty()).then(|| arm.method.name()));
        let words = words.join(", ");
        if presets.len() > 1 { format!("{words} ({})", arm.preset) } else { words }
    }
}

impl<'a> Arm<'a> {
    /// That of a run.
    pub fn of(run: &'a Run) -> Self {
        Arm { preset: &run.preset, variation: &run.variation, method: run.method }
    }
}

/// Colour and marker of a method, the same in every figure.
pub fn look(method: MethodName) -> usize {
    method as usize
}
