//! Two evaluations by episode: pairs where the same number is the same start, by what the tables themselves say of it.

use super::evaluated::{Evaluated, Outcome};
use crate::data::differences::{Difference, differences};
use crate::eval::{Pairs, Percentiles, newcombe_95, wilson_95};
use crate::table::{Column, Values};
use serde::Serialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// An episode that only one solved, or in which both failed in other ways.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Change {
    /// Its number.
    pub episode: i64,
    /// How it ended in the first: "success" or a class of failure.
    pub first: String,
    /// How in the second.
    pub second: String,
}

/// How two evaluations compare.
#[derive(Clone, Debug)]
pub struct Comparison<'a> {
    /// Both.
    pub of: [&'a Evaluated; 2],
    /// Why episodes are not paired; `None` where they are.
    pub apart: Option<String>,
    /// The paired episodes; zeros where there are none.
    pub pairs: Pairs,
    /// Episodes that ended in another way, in order.
    pub changes: Vec<Change>,
    /// First without second, of the pairs or of all episodes.
    pub difference: f64,
    /// Its 95 % interval.
    pub interval: [f64; 2],
    /// Two-sided p of McNemar's exact test, of pairs.
    pub mcnemar: Option<f64>,
    /// Control steps of the episodes that both solved, of pairs; of those that each solved otherwise.
    pub steps: [Percentiles; 2],
    /// At the end, of the episodes that are compared: name, and how many of the first and of the second.
    pub conditions: Vec<(String, [u64; 2])>,
    /// Failures by class, of the first and of the second.
    pub failures: BTreeMap<String, [u64; 2]>,
    /// Settings of the evaluations that differ, and of the trainings, where both are known.
    pub settings: Vec<Difference>,
}

/// Columns that say how an episode went, not where it began.
const WENT: [&str; 6] = ["episode", "success", "failure", "steps", "reward", "hit_obstacle"];
const CONDITION: &str = "condition.";

/// Holds two evaluations against each other.
pub fn compare<'a>(first: &'a Evaluated, second: &'a Evaluated) -> Comparison<'a> {
    let (ours, theirs) = (first.outcomes(), second.outcomes());
    let both = shared(&ours, &theirs);
    let apart = why_apart(first, second, &both);
    let paired: &[(Outcome, Outcome)] = if apart.is_none() { &both } else { &[] };
    let pairs = Pairs::of(paired.iter().map(|(a, b)| (a.success, b.success)));
    let changed = paired.iter().filter(|(a, b)| a.name() != b.name());
    let changes = changed.map(|(a, b)| Change { episode: a.episode, first: a.name().into(), second: b.name().into() }).collect();
    let compared: [Vec<Outcome>; 2] = if apart.is_none() {
        [both.iter().map(|(a, _)| *a).collect(), both.iter().map(|(_, b)| *b).collect()]
    } else {
        [ours, theirs]
    };
    let [first_counts, second_counts] = [&compared[0], &compared[1]].map(|all| counts(all));
    let rate = |(solved, all): (u64, u64)| solved as f64 / all.max(1) as f64;
    let (difference, interval) = match apart {
        None => (pairs.difference(), pairs.newcombe_95()),
        Some(_) => (rate(first_counts) - rate(second_counts), newcombe_95(first_counts, second_counts)),
    };
    let steps = match apart {
        None => steps_of(&both),
        Some(_) => [&compared[0], &compared[1]].map(|all| median(all.iter().filter(|o| o.success).map(|o| o.steps))),
    };
    Comparison {
        of: [first, second],
        mcnemar: apart.is_none().then(|| pairs.mcnemar_exact()),
        apart,
        pairs,
        changes,
        difference,
        interval,
        steps,
        conditions: conditions([first, second], &compared),
        failures: failures(&compared),
        settings: settings(first, second),
    }
}

fn counts(outcomes: &[Outcome]) -> (u64, u64) {
    (outcomes.iter().filter(|outcome| outcome.success).count() as u64, outcomes.len() as u64)
}

/// Episodes of the same number.
fn shared<'a>(first: &[Outcome<'a>], second: &[Outcome<'a>]) -> Vec<(Outcome<'a>, Outcome<'a>)> {
    let others: BTreeMap<i64, &Outcome> = second.iter().map(|outcome| (outcome.episode, outcome)).collect();
    first.iter().filter_map(|outcome| Some((*outcome, **others.get(&outcome.episode)?))).collect()
}

/// Why the same number is not the same episode: another task, another seed, another start.
fn why_apart(first: &Evaluated, second: &Evaluated, both: &[(Outcome, Outcome)]) -> Option<String> {
    let (one, other) = (&first.made, &second.made);
    if one.task != other.task || one.settings["task"] != other.settings["task"] {
        return Some(format!("the tasks are not the same: {} and {}", one.task, other.task));
    }
    if one.seed != other.seed {
        return Some(format!("the seeds of the evaluations are {} and {}", one.seed, other.seed));
    }
    if both.is_empty() {
        return Some("they have no episode in common".into());
    }
    let starts = |evaluated: &Evaluated| {
        let start = |column: &&Column| !WENT.contains(&column.name.as_str()) && !column.name.starts_with(CONDITION);
        evaluated.episodes.columns.iter().filter(start).cloned().collect::<Vec<Column>>()
    };
    let (ours, theirs) = (starts(first), starts(second));
    let names = |columns: &[Column]| columns.iter().map(|column| column.name.clone()).collect::<Vec<_>>();
    if names(&ours) != names(&theirs) {
        return Some("they say other things of where an episode begins".into());
    }
    let same = |a: &Column, b: &Column, at: &(Outcome, Outcome)| match (&a.values, &b.values) {
        (Values::F64(a), Values::F64(b)) => a[at.0.row].to_bits() == b[at.1.row].to_bits(),
        _ => false,
    };
    both.iter().find_map(|at| {
        let column = ours.iter().zip(&theirs).find(|(a, b)| !same(a, b, at))?.0;
        Some(format!("episode {} begins otherwise: {} is not the same", at.0.episode, column.name))
    })
}

/// Of the episodes that both solved.
fn steps_of(both: &[(Outcome, Outcome)]) -> [Percentiles; 2] {
    let solved = || both.iter().filter(|(a, b)| a.success && b.success);
    [median(solved().map(|(a, _)| a.steps)), median(solved().map(|(_, b)| b.steps))]
}

fn median(steps: impl Iterator<Item = i64>) -> Percentiles {
    Percentiles::of(steps.map(|steps| steps.max(0).cast_unsigned()).collect())
}

fn conditions(of: [&Evaluated; 2], compared: &[Vec<Outcome>; 2]) -> Vec<(String, [u64; 2])> {
    let names = of[0].episodes.columns.iter().filter_map(|column| column.name.strip_prefix(CONDITION));
    let held = |at: usize, name: &str| match &of[at].episodes.column(&format!("{CONDITION}{name}"))?.values {
        Values::Bool(flags) => Some(compared[at].iter().filter(|outcome| flags[outcome.row]).count() as u64),
        _ => None,
    };
    names.filter_map(|name| Some((name.to_string(), [held(0, name)?, held(1, name)?]))).collect()
}

fn failures(compared: &[Vec<Outcome>; 2]) -> BTreeMap<String, [u64; 2]> {
    let mut classes: BTreeMap<String, [u64; 2]> = BTreeMap::new();
    for (at, outcomes) in compared.iter().enumerate() {
        for outcome in outcomes.iter().filter(|outcome| !outcome.success) {
            classes.entry(outcome.failure.to_string()).or_default()[at] += 1;
        }
    }
    classes
}

/// Keys that differ: those of the evaluations, then those of the trainings that the evaluations do not have.
fn settings(first: &Evaluated, second: &Evaluated) -> Vec<Difference> {
    let mut found = differences("", &first.made.settings, &second.made.settings);
    // Of a policy that decides by itself how long it acts, this says nothing new.
    found.retain(|difference| difference.key != "evaluate.horizon_steps");
    if let (Some(ours), Some(theirs)) = (&first.trained, &second.trained) {
        let new = differences("", ours, theirs);
        let known: Vec<String> = found.iter().map(|difference| difference.key.clone()).collect();
        found.extend(new.into_iter().filter(|difference| !known.contains(&difference.key)));
    }
    found
}

impl Comparison<'_> {
    /// Episodes that only the first solved, and that only the second did.
    pub fn only(&self) -> [Vec<i64>; 2] {
        let of = |pick: fn(&Change) -> bool| self.changes.iter().filter(|c| pick(c)).map(|c| c.episode).collect();
        [of(|c| c.first == "success"), of(|c| c.second == "success")]
    }

    /// For machines.
    pub fn to_json(&self) -> Value {
        let one = |evaluated: &Evaluated| {
            let (solved, all) = evaluated.counts();
            json!({
                "name": evaluated.name,
                "episodes": evaluated.path.display().to_string(),
                "task": evaluated.made.task,
                "seed": evaluated.made.seed,
                "successes": solved,
                "of": all,
                "wilson_95": wilson_95(solved, all),
            })
        };
        let differing = |d: &Difference| json!({ "key": d.key, "first": d.theirs, "second": d.ours });
        json!({
            "kind": "comparison",
            "first": one(self.of[0]),
            "second": one(self.of[1]),
            "paired": self.apart.is_none(),
            "why_not_paired": self.apart,
            "pairs": self.apart.is_none().then_some(self.pairs),
            "difference": self.difference,
            "newcombe_95": self.interval,
            "mcnemar_exact_p": self.mcnemar,
            "changes": self.changes,
            "steps_p50": self.steps.map(|steps| steps.p50),
            "conditions": self.conditions.iter().map(|(name, n)| json!({ "name": name, "first": n[0], "second": n[1] })).collect::<Vec<_>>(),
            "failures": self.failures,
            "settings": self.settings.iter().map(differing).collect::<Vec<_>>(),
        })
    }
}

#[cfg(test)]
#[path = "pairing_tests.rs"]
pub(super) mod tests;
