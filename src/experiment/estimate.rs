//! How long steps take: by the wall times of finished ones of the same stage, task and method, otherwise by rates that were measured once.

use super::runs::Grid;
use super::state::State;
use super::step::Step;
use crate::config::{Pipeline, Stage};
use crate::learn::MethodName;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Processors of the machine of the rates: an AMD EPYC with AVX2, `make all` of stack.
const MEASURED_ON: f64 = 2.0;
/// Wall time of planning one demonstration there: 2.0 s for 330 \[s\].
const PLAN_S: f64 = 2.0 / 330.0;
/// Of executing one: 9.4 s for 330 \[s\].
const SIMULATE_S: f64 = 9.4 / 330.0;
/// Of converting one: 0.7 s for 330 \[s\].
const CONVERT_S: f64 = 0.7 / 330.0;
/// Of one demonstration in one epoch of pretraining: 14.1 s for 200 epochs of 273 demonstrations \[s\].
const PRETRAIN_S: f64 = 14.1 / (200.0 * 273.0);
/// Pretraining that may stop when it is flat took a fifth of its epochs.
const PRETRAIN_UNTIL_FLAT: f64 = 0.2;
/// Of one update of behavior cloning: 12.9 s for 8,000 of them and 700 of Algorithm 1, six times as long each \[s\].
const UPDATE_S: f64 = 12.9 / (8_000.0 + 6.0 * 700.0);
/// An update of Algorithm 1 over one of behavior cloning, with the demos per update that it was measured with.
const HIL_UPDATE: f64 = 6.0;
const HIL_BATCH: f64 = 8.0;
/// A control step of reinforcement learning with its share of the updates: 20.8 s for 102,400 \[s\].
const PPO_STEP_S: f64 = 20.8 / 102_400.0;
/// Of one episode of an evaluation: 11.3 s for 500 \[s\].
const EVALUATE_S: f64 = 11.3 / 500.0;
/// Control steps of one of those demonstrations.
const DEMO_STEPS: f64 = 95.0;
/// Lines of a log that a stage ends with.
const WALL: &str = "wall time ";
const PROCESSOR: &str = "processor time ";

/// Processor time of a step by the rates \[s\].
pub fn cost_s(stage: Stage, pipeline: &Pipeline, method: Option<MethodName>) -> f64 {
    let planned = pipeline.plan.episodes as f64;
    let demos = if pipeline.convert.demos == 0 { planned } else { planned.min(pipeline.convert.demos as f64) };
    let wall_s = match stage {
        Stage::Plan => planned * PLAN_S,
        Stage::Simulate => planned * SIMULATE_S,
        Stage::Convert => planned * CONVERT_S,
        Stage::Pretrain => {
            let part = if pipeline.pretrain.patience > 0 { PRETRAIN_UNTIL_FLAT } else { 1.0 };
            part * pipeline.pretrain.epochs as f64 * demos * PRETRAIN_S
        }
        Stage::Train => {
            let trials = if by_rewards(method) { pipeline.train.ppo.total_steps as f64 } else { 0.0 };
            let cloned = if method == Some(MethodName::Ppo) { 0.0 } else { updates(pipeline, demos, method) };
            trials * PPO_STEP_S + cloned * UPDATE_S
        }
        Stage::Evaluate => pipeline.evaluate.episodes as f64 * EVALUATE_S,
    };
    wall_s * MEASURED_ON
}

fn by_rewards(method: Option<MethodName>) -> bool {
    matches!(method, Some(MethodName::Ppo | MethodName::BcRl))
}

/// Updates on demos, counted in those of behavior cloning.
fn updates(pipeline: &Pipeline, demos: f64, method: Option<MethodName>) -> f64 {
    let transitions = (demos * DEMO_STEPS) as usize;
    let train = method.map_or_else(|| pipeline.train.clone(), |method| method.own_settings(&pipeline.train, transitions));
    let per_epoch = (demos / train.batch.max(1) as f64).ceil().max(1.0);
    let of_algorithm_1 = train.epochs_of(per_epoch as u64) as f64 * per_epoch;
    let each =
        if matches!(method, Some(MethodName::Bc | MethodName::BcRl)) { 1.0 } else { HIL_UPDATE * train.batch as f64 / HIL_BATCH };
    train.warm_start(transitions) as f64 + each * of_algorithm_1
}

/// The wall time that a log ends with \[s\].
pub fn wall_s_of(log: &Path) -> Option<f64> {
    seconds_of(log, WALL)
}

/// The processor time that a log ends with \[s\].
pub fn processor_s_of(log: &Path) -> Option<f64> {
    seconds_of(log, PROCESSOR)
}

fn seconds_of(log: &Path, what: &str) -> Option<f64> {
    let text = fs::read_to_string(log).ok()?;
    let last = text.lines().rev().find_map(|line| line.strip_prefix(what))?;
    last.strip_suffix(" s")?.parse().ok()
}

/// Steps whose times are alike: of one stage, task and method.
type Kind = (&'static str, String, Option<&'static str>);

/// Wall times of steps, `threads` each.
pub struct Estimate {
    threads: f64,
    /// Measured over stated wall time, by stage, task and method.
    ratios: BTreeMap<Kind, f64>,
}

impl Estimate {
    /// By what is finished of a grid.
    pub fn of(grid: &Grid, states: &[State], threads: usize) -> Self {
        let threads = threads as f64;
        let mut sums = BTreeMap::<_, [f64; 2]>::new();
        for (step, _) in grid.steps.iter().zip(states).filter(|(_, state)| **state == State::Done) {
            if let Some(measured_s) = wall_s_of(&step.log) {
                let [measured, stated] = sums.entry(key(step)).or_default();
                *measured += measured_s;
                *stated += step.cost_s / threads;
            }
        }
        let ratios = sums.into_iter().filter(|(_, [_, stated])| *stated > 0.0);
        Estimate { threads, ratios: ratios.map(|(key, [measured, stated])| (key, measured / stated)).collect() }
    }

    /// Wall time of a step \[s\], and whether it comes from finished ones.
    pub fn of_step(&self, step: &Step) -> (f64, bool) {
        let ratio = self.ratios.get(&key(step));
        (step.cost_s / self.threads * ratio.unwrap_or(&1.0), ratio.is_some())
    }

    /// Wall time of all steps that are not done \[s\], `jobs` at a time, and how many of them are estimated by finished ones.
    pub fn of_all(&self, grid: &Grid, states: &[State], jobs: usize) -> (f64, usize) {
        let (mut sum, mut longest, mut measured) = (0.0, 0.0_f64, 0);
        let mut ends = vec![0.0_f64; grid.steps.len()];
        for (i, step) in grid.steps.iter().enumerate() {
            let begins = step.needs().map(|from| ends[from]).fold(0.0, f64::max);
            let (seconds, by_finished) = if states[i] == State::Done { (0.0, false) } else { self.of_step(step) };
            ends[i] = begins + seconds;
            (sum, longest, measured) = (sum + seconds, longest.max(ends[i]), measured + usize::from(by_finished));
        }
        (f64::max(sum / jobs as f64, longest), measured)
    }
}

fn key(step: &Step) -> Kind {
    (step.stage.name(), step.task.clone(), step.method.map(MethodName::name))
}

/// A time in words: `40 s`, `12 min`, `3.5 h`.
pub fn in_words(seconds: f64) -> String {
    match seconds {
        s if s < 90.0 => format!("{s:.0} s"),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}
