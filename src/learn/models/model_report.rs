//! How far the dynamics network is off on unseen demos, beside two models that know nothing.

use super::corpus::Corpus;
use super::dynamics::Dynamics;
use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::layout::{Holds, Layout};
use crate::math::acos;
use crate::nn::{LANES, Panels, Pass};
use crate::table::{Table, Values, unit_of};
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

/// Entries of a state that are judged together.
struct Group {
    name: String,
    unit: &'static str,
    entries: Range<usize>,
    measure: Measure,
}

/// What the error of a group is.
#[derive(Clone, Copy)]
enum Measure {
    /// Mean square of its entries.
    Mean,
    /// Square distance.
    Distance,
    /// Square angle between unit quaternions.
    Angle,
}

/// The groups of a layout: joints of the arm and the fingers, positions and rotations of objects, and what else may change.
fn groups(layout: &Layout) -> Vec<Group> {
    let mut groups = Vec::new();
    let mut push = |name: String, unit, entries: Range<usize>, measure| {
        if !entries.is_empty() {
            groups.push(Group { name, unit, entries, measure });
        }
    };
    for (span, at) in layout.state_spans() {
        let of = |part: Range<usize>| at.start + part.start..at.start + part.end;
        let name = &span.name;
        match span.holds {
            Holds::JointPositions | Holds::JointVelocities => {
                let usual = if span.holds == Holds::JointPositions { "rad" } else { "rad/s" };
                let parts = [("arm", layout.arm()), ("finger", layout.fingers())];
                if parts.iter().all(|(_, part)| part.is_empty()) {
                    push(name.clone(), usual, at.clone(), Measure::Mean);
                }
                for (part, range) in parts {
                    let unit = span.entries[range.clone()].first().and_then(|entry| unit_of(entry)).unwrap_or(usual);
                    push(format!("{part}_{name}"), unit, of(range), Measure::Mean);
                }
            }
            Holds::Pose => {
                push(format!("{name}_position"), "m", at.start..at.start + 3, Measure::Distance);
                push(format!("{name}_rotation"), "rad", at.start + 3..at.end, Measure::Angle);
            }
            Holds::Numbers => push(name.clone(), "", at.clone(), Measure::Mean),
            _ => {}
        }
    }
    groups
}

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
    let groups = groups(&corpus.layout);
    let names = |pick: fn(&Group) -> String| Values::Text(groups.iter().map(pick).collect());
    let mut table = Table::default().with("group", "Entries of the state", names(|g| g.name.clone())).with(
        "unit",
        "Unit of the errors",
        names(|g| g.unit.into()),
    );
    for (name, model) in [("network", Model::Network), ("unchanged", Model::Unchanged), ("integrated", Model::Integrated)] {
        for steps in HORIZONS {
            let errors = errors(dynamics, corpus, model, (&groups, steps), interrupt)?;
            let plural = if steps == 1 { "step" } else { "steps" };
            let doc = format!("RMS error of the model \"{name}\" after {steps} control {plural}, open loop");
            table = table.with(&format!("{name}_{steps}_{plural}"), &doc, Values::F64(errors));
        }
    }
    Ok(table)
}

/// RMS error of each group when every state that has a state `steps` later is rolled forward with the executed actions.
fn errors(
    dynamics: &Dynamics,
    corpus: &Corpus,
    model: Model,
    (groups, steps): (&[Group], usize),
    interrupt: &Interrupt,
) -> Result<Vec<f64>> {
    let dim = corpus.layout.state_dim();
    let (mut sums, mut count) = (vec![0.0f64; groups.len()], 0usize);
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
            sums.iter_mut().zip(groups).for_each(|(sum, group)| *sum += square_error(state, truth, group));
        }
        count += rows;
    }
    Ok(sums.iter().map(|sum| (sum / count as f64).sqrt()).collect())
}

/// One step of all `states`; row r is given the executed action of transition `first + r`.
fn advance(dynamics: &Dynamics, corpus: &Corpus, model: Model, first: usize, states: &mut [f32], pass: &mut Pass) {
    let (layout, dim) = (&corpus.layout, corpus.layout.state_dim());
    let (q, dq) = (layout.positions(), layout.velocities());
    let action = |r: usize| corpus.executed(first + r);
    match model {
        Model::Unchanged => {}
        Model::Integrated => {
            for (r, state) in states.chunks_exact_mut(dim).enumerate() {
                q.clone().zip(action(r)).for_each(|(i, a)| state[i] += dynamics.dt_s() * a);
                dq.clone().zip(action(r)).for_each(|(i, a)| state[i] = *a);
            }
        }
        Model::Network => {
            pass.grow(&dynamics.net, 1);
            let (mut panel, mut actions) = (Panels::default(), Panels::default());
            panel.grow(dim, 1);
            actions.grow(layout.action_dim(), 1);
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

/// As the group is measured.
fn square_error(state: &[f32], truth: &[f32], Group { entries, measure, .. }: &Group) -> f64 {
    let pairs = || entries.clone().map(|i| (f64::from(state[i]), f64::from(truth[i])));
    let sum = pairs().map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    match measure {
        Measure::Mean => sum / entries.len() as f64,
        Measure::Distance => sum,
        Measure::Angle => {
            let dot = |f: fn((f64, f64)) -> f64| pairs().map(f).sum::<f64>();
            let cos = dot(|(a, b)| a * b).abs() / (dot(|(a, _)| a * a) * dot(|(_, b)| b * b)).sqrt();
            (2.0 * acos(cos.min(1.0))).powi(2)
        }
    }
}
