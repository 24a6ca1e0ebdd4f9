//! How far the dynamics network is off on unseen demos, beside two models that know nothing.

use super::corpus::Corpus;
use super::dynamics::{DT_S, Dynamics};
use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::math::acos;
use crate::nn::{LANES, Panels, Pass};
use crate::state::{ARM_JOINTS, BASE_DIM, JOINTS};
use crate::table::{Table, Values};
use std::ops::Range;

/// What pretraining reports.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelReport {
    /// Open-loop errors by state group and model, RMS over the validation demos: one row a group, columns `network_1_step`,
    /// `network_10_steps`, `unchanged_*` (nothing changes) and `integrated_*` (joints integrate their command).
    pub errors: Table,
    /// One row an epoch.
    pub metrics: Table,
}

/// Horizons of the report in control steps.
const HORIZONS: [usize; 2] = [1, 10];
/// State groups, their units, and their entries.
const GROUPS: [(&str, &str, Range<usize>); 6] = [
    ("arm_q", "rad", 0..ARM_JOINTS),
    ("finger_q", "rad", ARM_JOINTS..JOINTS),
    ("arm_dq", "rad/s", JOINTS..JOINTS + ARM_JOINTS),
    ("finger_dq", "rad/s", JOINTS + ARM_JOINTS..2 * JOINTS),
    ("block_position", "m", 2 * JOINTS..2 * JOINTS + 3),
    ("block_rotation", "rad", 2 * JOINTS + 3..BASE_DIM),
];

#[derive(Clone, Copy)]
enum Model {
    Network,
    Unchanged,
    Integrated,
}

/// See [`ModelReport::errors`].
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub fn error_table(dynamics: &Dynamics, corpus: &Corpus, interrupt: &Interrupt) -> Result<Table> {
    let names = |pick: fn(&(&str, &str, Range<usize>)) -> String| Values::Text(GROUPS.iter().map(pick).collect());
    let mut table = Table::default().with("group", "Entries of the state", names(|g| g.0.into())).with(
        "unit",
        "Unit of the errors",
        names(|g| g.1.into()),
    );
    for (name, model) in [("network", Model::Network), ("unchanged", Model::Unchanged), ("integrated", Model::Integrated)] {
        for steps in HORIZONS {
            let errors = errors(dynamics, corpus, model, steps, interrupt)?;
            let plural = if steps == 1 { "step" } else { "steps" };
            let doc = format!("RMS error of the model \"{name}\" after {steps} control {plural}, open loop");
            table = table.with(&format!("{name}_{steps}_{plural}"), &doc, Values::F64(errors.to_vec()));
        }
    }
    Ok(table)
}

/// RMS error of each group when every state that has a state `steps` later is rolled forward with the executed actions.
fn errors(
    dynamics: &Dynamics,
    corpus: &Corpus,
    model: Model,
    steps: usize,
    interrupt: &Interrupt,
) -> Result<[f64; GROUPS.len()]> {
    let dim = corpus.task.state_dim();
    let (mut sums, mut count) = ([0.0f64; GROUPS.len()], 0usize);
    let mut pass = Pass::default();
    for demo in (0..corpus.demos()).map(|i| corpus.demo(i)).filter(|d| d.len() >= steps) {
        interrupt.check()?;
        let rows = demo.len() + 1 - steps;
        let mut states = (demo.start..demo.start + rows).flat_map(|r| corpus.state(r)).copied().collect::<Vec<f32>>();
        for k in 0..steps {
            advance(dynamics, corpus, model, demo.start + k, &mut states, &mut pass);
        }
        for (r, state) in states.chunks_exact(dim).enumerate() {
            let truth = corpus.next(demo.start + r + steps - 1);
            sums.iter_mut().zip(&GROUPS).for_each(|(sum, group)| *sum += square_error(state, truth, group));
        }
        count += rows;
    }
    Ok(sums.map(|sum| (sum / count as f64).sqrt()))
}

/// One step of all `states`; row r is given the executed action of transition `first + r`.
fn advance(dynamics: &Dynamics, corpus: &Corpus, model: Model, first: usize, states: &mut [f32], pass: &mut Pass) {
    let dim = corpus.task.state_dim();
    let action = |r: usize| corpus.executed(first + r);
    match model {
        Model::Unchanged => {}
        Model::Integrated => {
            for (r, state) in states.chunks_exact_mut(dim).enumerate() {
                for (i, a) in action(r).iter().enumerate() {
                    state[i] += DT_S * a;
                    state[JOINTS + i] = *a;
                }
            }
        }
        Model::Network => {
            pass.reserve(&dynamics.net, 1);
            let (mut panel, mut actions) = (Panels::default(), Panels::default());
            panel.reserve(dim, 1);
            actions.reserve(JOINTS, 1);
            for (p, block) in states.chunks_mut(LANES * dim).enumerate() {
                for (r, state) in block.chunks_exact(dim).enumerate() {
                    panel.write_row(r, state);
                    actions.write_row(r, action(p * LANES + r));
                }
                dynamics.step(panel.panel_mut(0), actions.panel(0), pass);
                block.chunks_exact_mut(dim).enumerate().for_each(|(r, state)| panel.read_row(r, state));
            }
        }
    }
}

/// Mean square over the entries of a joint group, square distance of a position, square angle of a rotation.
fn square_error(state: &[f32], truth: &[f32], (name, _, entries): &(&str, &str, Range<usize>)) -> f64 {
    let pairs = || entries.clone().map(|i| (f64::from(state[i]), f64::from(truth[i])));
    let sum = pairs().map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    match *name {
        "block_position" => sum,
        "block_rotation" => {
            let dot = |f: fn((f64, f64)) -> f64| pairs().map(f).sum::<f64>();
            let cos = dot(|(a, b)| a * b).abs() / (dot(|(a, _)| a * a) * dot(|(_, b)| b * b)).sqrt();
            (2.0 * acos(cos.min(1.0))).powi(2)
        }
        _ => sum / entries.len() as f64,
    }
}
