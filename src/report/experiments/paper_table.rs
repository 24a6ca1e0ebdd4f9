//! A table of the paper beside ours, and where the two order things differently.

use super::comparisons::compare;
use super::finished::{Arm, Finished};
use super::words::{minutes, percent, percent_within};
use crate::report::page::{Block, Cell, Column, Table};
use crate::report::paper::{PaperRow, PaperTable, TASKS};
use crate::report::statistics::Verdict;

/// The table for each preset and method, and what differs in order.
pub fn blocks(finished: &Finished, paper: &PaperTable) -> Vec<Block> {
    let experiment = &finished.experiment;
    let mut blocks = Vec::new();
    if tasks(finished).is_empty() {
        return blocks;
    }
    for preset in &experiment.presets {
        for method in &experiment.methods {
            let arms = finished.arms().into_iter().filter(|arm| (arm.preset, arm.method) == (preset, *method));
            let arms: Vec<Arm> = arms.collect();
            let of = if experiment.methods.len() > 1 {
                format!("preset {preset}, method {}", method.name())
            } else {
                format!("preset {preset}")
            };
            if !arms.is_empty() {
                blocks.push(Block::Table(table(finished, paper, &of, &arms)));
                blocks.extend(order(finished, paper, &of, &arms));
            }
        }
    }
    blocks
}

/// The experiment's tasks that the paper has, in the order of the file.
fn tasks(finished: &Finished) -> Vec<&str> {
    finished.experiment.tasks.iter().map(String::as_str).filter(|task| TASKS.contains(task)).collect()
}

fn table(finished: &Finished, paper: &PaperTable, of: &str, arms: &[Arm]) -> Table {
    let tasks = tasks(finished);
    let mut columns = vec![Column::words(paper.varies)];
    for task in &tasks {
        columns.extend([Column::of(task, "paper, %"), Column::of(task, "here, %")]);
        if paper.timed {
            columns.extend([Column::of(task, "paper, min"), Column::of(task, "here, min")]);
        }
    }
    let of_row = |row: &PaperRow| arms.iter().find(|arm| arm.variation == row.variation).copied();
    let highest = |values: &mut dyn Iterator<Item = Option<f64>>| values.flatten().fold(0.0, f64::max);
    let row = |row: &PaperRow| {
        let mut cells = vec![Cell::from(row.label)];
        for task in &tasks {
            let theirs = row.success(task);
            let best = highest(&mut paper.rows.iter().map(|row| row.success(task)));
            cells.push(Cell { text: theirs.map_or("failed".into(), percent), strong: theirs == Some(best) });
            let value = |row: &PaperRow| of_row(row).and_then(|arm| finished.success(arm, task)).map(|found| found.value);
            let best = highest(&mut paper.rows.iter().map(value));
            let ours = of_row(row).and_then(|arm| finished.success(arm, task));
            let strong = ours.is_some_and(|found| found.value == best && best > 0.0);
            cells.push(Cell { text: ours.map_or("–".into(), percent_within), strong });
            if paper.timed {
                cells.push(row.minutes(task).map_or("–".into(), |minutes| format!("{minutes:.0}")).into());
                cells.push(minutes(of_row(row).and_then(|arm| finished.train_s(arm, task, |m| m.train_s))));
            }
        }
        cells
    };
    let name = paper.name;
    let times = if paper.timed {
        " Minutes here: wall time of `hilt train` alone, by its log; those of the paper are from another machine."
    } else {
        ""
    };
    let caption = format!(
        "{name} of the paper beside {of}; the highest of each column stands out. {}{times}",
        super::common::intervals(finished)
    );
    Table { caption, columns, rows: paper.rows.iter().map(row).collect() }
}

/// Where the order by success is another than the paper's, in words.
fn order(finished: &Finished, paper: &PaperTable, of: &str, arms: &[Arm]) -> Vec<Block> {
    let mut items = Vec::new();
    for task in tasks(finished) {
        let mut shown: Vec<(&PaperRow, Arm, f64, f64)> = Vec::new();
        for row in paper.rows {
            let arm = arms.iter().find(|arm| arm.variation == row.variation);
            if let Some((arm, found)) = arm.and_then(|arm| finished.success(*arm, task).map(|found| (*arm, found.value))) {
                shown.push((row, arm, row.success(task).unwrap_or(0.0), found));
            }
        }
        let theirs = ranked(&shown.iter().map(|(row, _, paper, _)| (row.label, *paper)).collect::<Vec<_>>());
        let ours = ranked(&shown.iter().map(|(row, _, _, here)| (row.label, *here)).collect::<Vec<_>>());
        let (mut reversed, mut open) = (Vec::new(), 0);
        for (a, x, theirs_x, here_x) in &shown {
            for (b, y, theirs_y, here_y) in shown.iter().filter(|(_, _, other, _)| theirs_x > other) {
                match compare(finished, *x, *y, &[task]).map(|found| found.verdict()) {
                    Some(Verdict::Worse) => {
                        reversed.push(format!("{} ({}) below {} ({})", a.label, percent(*here_x), b.label, percent(*here_y)))
                    }
                    _ if here_x <= here_y && theirs_x > theirs_y => open += 1,
                    _ => {}
                }
            }
        }
        if reversed.is_empty() && open == 0 {
            continue;
        }
        let beyond = if reversed.is_empty() {
            String::new()
        } else {
            format!(" Beyond what seeds explain, against the paper: {}.", reversed.join("; "))
        };
        let within = match open {
            0 => String::new(),
            1 => " One pair is equal or the other way round here, but not told apart.".into(),
            n => format!(" {n} pairs are equal or the other way round here, but not told apart."),
        };
        items.push(format!("{task}: the paper has {theirs}; here it is {ours}.{beyond}{within}"));
    }
    if items.is_empty() {
        return Vec::new();
    }
    vec![Block::Words(format!("The order by success differs from the paper's under {of}:")), Block::List(items)]
}

/// `a > b = c`, the best first.
fn ranked(of: &[(&str, f64)]) -> String {
    let mut sorted = of.to_vec();
    sorted.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut text = String::new();
    for (i, (name, value)) in sorted.iter().enumerate() {
        text += match i {
            0 => "",
            _ if sorted[i - 1].1 == *value => " = ",
            _ => " > ",
        };
        // The letters alone: what stands in brackets is for the table.
        text += name.split(" (").next().unwrap_or(name);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_are_from_the_best_and_ties_are_ties() {
        assert_eq!(ranked(&[("a (BC)", 0.1), ("b", 0.7), ("c", 0.1)]), "b > a = c");
    }
}
