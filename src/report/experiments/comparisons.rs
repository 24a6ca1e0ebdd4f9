//! Which arms are better than which, in numbers and in words.

use super::finished::{Arm, Finished};
use super::words::{listed, points_within, probability_within};
use crate::experiment::ReportKind;
use crate::report::page::{Block, Cell, Column, Table};
use crate::report::statistics::{Comparison, Verdict};

/// Two arms.
type Pair<'a> = (Arm<'a>, Arm<'a>);

/// Table and words of all comparisons that an experiment asks for; nothing where it has only one arm.
pub fn blocks(finished: &Finished) -> Vec<Block> {
    let (pairs, tasks) = (pairs(finished), finished.tasks());
    let compared: Vec<Compared> = pairs.iter().filter_map(|pair| Compared::of(finished, *pair, &tasks)).collect();
    if compared.is_empty() {
        return Vec::new();
    }
    let mut blocks = vec![Block::Heading("Which is better".into())];
    blocks.extend(in_words(&compared));
    let over = if tasks.len() > 1 { ", over all tasks" } else { "" };
    blocks.push(Block::Table(table(format!("Comparisons of arms{over}"), &compared)));
    if tasks.len() > 1 {
        let single = tasks.iter().flat_map(|task| pairs.iter().filter_map(|pair| Compared::of(finished, *pair, &[*task])));
        let single: Vec<Compared> = single.collect();
        blocks.push(Block::Details("Task by task".into(), vec![Block::Table(table("Comparisons on each task".into(), &single))]));
    }
    blocks
}

/// A comparison with its names.
struct Compared {
    names: [String; 2],
    tasks: String,
    found: Comparison,
}

impl Compared {
    fn of(finished: &Finished, (x, y): Pair, tasks: &[&str]) -> Option<Self> {
        let found = compare(finished, x, y, tasks)?;
        let shared = tasks.iter().filter(|task| !finished.scores(x, task).is_empty() && !finished.scores(y, task).is_empty());
        let tasks: Vec<String> = shared.map(|task| task.to_string()).collect();
        Some(Compared { names: [finished.label(x), finished.label(y)], tasks: tasks.join(", "), found })
    }
}

/// Two arms on these tasks; `None` when they share no seed.
pub fn compare(finished: &Finished, x: Arm, y: Arm, tasks: &[&str]) -> Option<Comparison> {
    Comparison::of(&finished.strata(x, tasks), &finished.strata(y, tasks))
}

/// What is compared: in a ladder each rung with the one below it; otherwise methods where there are several, and with one method each variation
/// with the reference.
fn pairs(finished: &Finished) -> Vec<Pair<'_>> {
    let experiment = &finished.experiment;
    let arms = arms(finished);
    let below = |arm: &Arm| match experiment.report {
        ReportKind::Ladder => experiment.variations.iter().find(|v| v.name == arm.variation)?.extends.clone(),
        _ => experiment.reference.clone().or_else(|| experiment.variations.first().map(|v| v.name.clone())),
    };
    let mut pairs = Vec::new();
    for (i, x) in arms.iter().enumerate() {
        for y in &arms[i + 1..] {
            let same_settings = experiment.report == ReportKind::Training || x.variation == y.variation;
            if same_settings && x.preset == y.preset && x.method != y.method {
                pairs.push((*x, *y));
            }
        }
        if experiment.methods.len() == 1 || experiment.report == ReportKind::Ladder {
            let other = below(x).filter(|name| name != x.variation);
            let other =
                other.and_then(|name| arms.iter().find(|y| y.variation == name && (y.preset, y.method) == (x.preset, x.method)));
            pairs.extend(other.map(|y| if experiment.report == ReportKind::Ladder { (*x, *y) } else { (*y, *x) }));
        }
    }
    pairs
}

/// The arms that are compared: all, but of trainings of several lengths the longest of each method.
pub fn arms(finished: &Finished) -> Vec<Arm<'_>> {
    match finished.experiment.report {
        ReportKind::Training => super::training::longest(finished),
        _ => finished.arms(),
    }
}

fn in_words(compared: &[Compared]) -> Vec<Block> {
    let of = |verdict: Verdict| compared.iter().filter(move |c| c.found.verdict() == verdict);
    let mut items = Vec::new();
    let better = of(Verdict::Better).map(|c| [&c.names[0], &c.names[1]]);
    for [x, y] in better.chain(of(Verdict::Worse).map(|c| [&c.names[1], &c.names[0]])) {
        items.push(format!("`{x}` is better than `{y}`."));
    }
    let pairs = |verdict| of(verdict).map(|c| format!("`{}` and `{}`", c.names[0], c.names[1])).collect::<Vec<_>>();
    let (even, few) = (pairs(Verdict::CannotTell), pairs(Verdict::TooFew));
    if !even.is_empty() {
        items.push(format!("These cannot be told apart by the seeds that there are: {}.", even.join("; ")));
    }
    if !few.is_empty() {
        let who = if few.len() == compared.len() { "all of them".into() } else { listed(&few) };
        items.push(format!("Too few seeds to tell (fewer than three): {who}."));
    }
    vec![Block::List(items)]
}

fn table(caption: String, compared: &[Compared]) -> Table {
    let row = |c: &Compared| {
        let verdict = match c.found.verdict() {
            Verdict::Better => "better",
            Verdict::Worse => "worse",
            Verdict::CannotTell => "cannot be told apart",
            Verdict::TooFew => "too few seeds",
        };
        let alone = |words: String| if c.found.pairs > 1 { words } else { words.split(" [").next().unwrap_or_default().into() };
        let difference = alone(points_within(c.found.difference));
        let improvement = alone(probability_within(c.found.improvement));
        let [x, y] = &c.names;
        let words = [x.clone(), y.clone(), c.tasks.clone(), c.found.pairs.to_string(), difference, improvement, verdict.into()];
        words.map(Cell::from).to_vec()
    };
    let columns = vec![
        Column::words("this"),
        Column::words("against"),
        Column::words("tasks"),
        Column::number("seeds"),
        Column::number("difference, points"),
        Column::number("probability of improvement"),
        Column::words("this is"),
    ];
    Table { caption, columns, rows: compared.iter().map(row).collect() }
}
