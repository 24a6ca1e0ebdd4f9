//! What every section has: how far the experiment is, success of every arm, failures, how it was made.

use super::finished::{Arm, Finished, Measured, look};
use super::words::{listed, percent, percent_within, seeds};
use crate::experiment::DIRECTORY;
use crate::experiment::estimate::{in_words, wall_s_of};
use crate::report::chart::{Datum, Picture, Row, Rows};
use crate::report::page::{Block, Cell, Column, Table};
use crate::report::statistics::{Strata, interquartile_mean, mean};
use crate::tasks::FailureClass;
use std::path::Path;

/// How far the experiment is, and what the author says of it.
pub fn head(finished: &Finished) -> Vec<Block> {
    let (done, all) = (finished.runs.len(), finished.grid.runs.len());
    let mut blocks = Vec::new();
    if done < all {
        blocks.push(Block::Words(format!("Not finished: {done} of {all} runs are there, and all that follows is of these.")));
        blocks.push(Block::Details("What is missing".into(), vec![Block::List(missing(finished))]));
    }
    let notes = finished.experiment.notes.split("\n\n").map(|words| words.split_whitespace().collect::<Vec<_>>().join(" "));
    blocks.extend(notes.filter(|words| !words.is_empty()).map(Block::Words));
    blocks
}

/// Unfinished runs: an item a task and seeds, with the arms that lack them.
fn missing(finished: &Finished) -> Vec<String> {
    let lacking = finished.grid.runs.iter().filter(|run| finished.contents[run.evaluate].is_none());
    let seeds_of = grouped(lacking.map(|run| ((run.task.as_str(), Arm::of(run)), run.seed)));
    let arms_of = grouped(seeds_of.into_iter().map(|((task, arm), list)| ((task, seeds(&list)), arm)));
    let every =
        |task: &str| grouped(finished.grid.runs.iter().filter(|run| run.task == task).map(|run| (Arm::of(run), ()))).len();
    let item = |((task, seeds), arms): ((&str, String), Vec<Arm>)| {
        let names: Vec<String> = arms.iter().map(|arm| format!("`{}`", finished.label(*arm))).collect();
        let names = if arms.len() > 1 && arms.len() == every(task) { format!("all {}", arms.len()) } else { listed(&names) };
        format!("{task}, seeds {seeds}: {names}")
    };
    arms_of.into_iter().map(item).collect()
}

/// The values of each key, in the order in which the keys came.
fn grouped<K: PartialEq, V>(pairs: impl Iterator<Item = (K, V)>) -> Vec<(K, Vec<V>)> {
    pairs.fold(Vec::new(), |mut groups: Vec<(K, Vec<V>)>, (key, value)| {
        match groups.iter_mut().find(|(known, _)| *known == key) {
            Some((_, values)) => values.push(value),
            None => groups.push((key, vec![value])),
        }
        groups
    })
}

/// A caption's last sentence: what the intervals are.
pub fn intervals(finished: &Finished) -> &'static str {
    let several = finished.arms().iter().any(|arm| finished.tasks().iter().any(|task| finished.of(*arm, task).count() > 1));
    if several {
        "Intervals: 95 %, over seeds by the bootstrap; of one seed Wilson's over its episodes."
    } else {
        "One seed each; intervals: Wilson 95 % over its episodes."
    }
}

/// Success of every arm on every task as a figure: a row a variation, a panel a task, a marker a method.
pub fn success_figure(finished: &Finished) -> Picture {
    let (tasks, experiment) = (finished.tasks(), &finished.experiment);
    let mut rows: Vec<Row> = Vec::new();
    for arm in finished.arms() {
        let words = if arm.variation.is_empty() { arm.preset.to_string() } else { arm.variation.to_string() };
        let many = experiment.presets.len() > 1 && !arm.variation.is_empty();
        let name = if many { format!("{words} ({})", arm.preset) } else { words };
        let data = tasks.iter().enumerate().filter_map(|(panel, task)| {
            let estimate = finished.success(arm, task)?;
            let singles = finished.singles(arm, task);
            let series = arm.method.name().to_string();
            Some(Datum { panel, look: look(arm.method), series, value: estimate.value, interval: estimate.interval, singles })
        });
        match rows.iter_mut().find(|row| row.name == name) {
            Some(row) => row.data.extend(data),
            None => rows.push(Row { name, data: data.collect() }),
        }
    }
    let rows = Rows {
        id: format!("{}-success", experiment.name),
        title: experiment.description.clone(),
        description:
            "Success rates with intervals, a row for each variation and a panel for each task; the table below has the numbers"
                .into(),
        x_label: "success".into(),
        note: "markers: mean over seeds, with 95 % intervals; dots: single seeds".into(),
        panels: tasks.iter().map(|task| task.to_string()).collect(),
        rows,
    };
    rows.draw()
}

/// The same in numbers.
pub fn success_table(finished: &Finished) -> Table {
    let tasks = finished.tasks();
    let mut columns = vec![Column::words("")];
    for task in &tasks {
        columns.extend([Column::of(task, "success, %"), Column::of(task, "seeds")]);
    }
    let row = |arm: &Arm| {
        let mut cells = vec![Cell::from(finished.label(*arm))];
        for task in &tasks {
            let count = finished.of(*arm, task).count();
            let success = finished.success(*arm, task).map_or("–".into(), percent_within);
            cells.extend([success.into(), if count == 0 { "–".into() } else { count.to_string().into() }]);
        }
        cells
    };
    let caption = format!("Success. {}", intervals(finished));
    Table { caption, columns, rows: finished.arms().iter().map(row).collect() }
}

/// Interquartile mean and mean of these arms over all tasks; `None` where they say nothing new.
pub fn aggregates(finished: &Finished, arms: &[Arm]) -> Option<Block> {
    let tasks = finished.tasks();
    if tasks.len() < 2 {
        return None;
    }
    let row = |arm: &Arm| {
        let has_runs = |task: &&&str| finished.of(*arm, task).next().is_some();
        let tasks: Vec<&str> = tasks.iter().filter(has_runs).copied().collect();
        let strata = balanced(finished.strata(*arm, &tasks));
        let count = strata[0].len();
        let names = if tasks.len() == finished.tasks().len() { "all".into() } else { tasks.join(", ") };
        let values = [interquartile_mean, mean].map(|statistic| match count {
            0 => "–".into(),
            1 => percent(statistic(&strata).value),
            _ => percent_within(statistic(&strata)),
        });
        let mut cells = [finished.label(*arm), names, count.to_string()].map(Cell::from).to_vec();
        cells.extend(values.map(Cell::from));
        cells
    };
    let columns = vec![
        Column::words(""),
        Column::words("tasks"),
        Column::number("seeds"),
        Column::number("interquartile mean, %"),
        Column::number("mean, %"),
    ];
    let caption =
        "Success over all tasks, of the seeds that every task has, with 95 % intervals by the bootstrap over seeds within tasks."
            .into();
    Some(Block::Table(Table { caption, columns, rows: arms.iter().map(row).collect() }))
}

/// The seeds that every task has, so that no task counts more than another.
fn balanced(strata: Strata) -> Strata {
    let everywhere = |seed: u64| strata.iter().all(|task| task.iter().any(|score| score.seed == seed));
    strata.iter().map(|task| task.iter().filter(|score| everywhere(score.seed)).copied().collect()).collect()
}

/// Failed episodes by class, a row an arm and task; classes that never came are left out.
pub fn failures(finished: &Finished) -> Option<Block> {
    let count = |runs: &[&Measured], class: FailureClass| -> u64 {
        runs.iter().map(|m| m.summary.failures.get(class.name()).copied().unwrap_or(0)).sum()
    };
    let all: Vec<&Measured> = finished.runs.iter().collect();
    let classes: Vec<FailureClass> = FailureClass::ALL.into_iter().filter(|class| count(&all, *class) > 0).collect();
    if classes.is_empty() {
        return None;
    }
    let mut rows = Vec::new();
    for arm in finished.arms() {
        for task in finished.tasks() {
            let runs: Vec<&Measured> = finished.of(arm, task).collect();
            let episodes: u64 = runs.iter().map(|m| m.summary.episodes).sum();
            let share = |n: u64| Cell::from(if n == 0 { "–".into() } else { percent(n as f64 / episodes as f64) });
            if episodes > 0 {
                let mut cells = [finished.label(arm), task.to_string(), episodes.to_string()].map(Cell::from).to_vec();
                cells.extend(classes.iter().map(|class| share(count(&runs, *class))));
                rows.push(cells);
            }
        }
    }
    let mut columns = vec![Column::words(""), Column::words("task"), Column::number("episodes")];
    columns.extend(classes.iter().map(|class| Column::number(&class.name().replace('_', " "))));
    let meanings = classes.iter().map(|class| format!("{}: {}", class.name().replace('_', " "), class.words())).collect();
    let table = Table { caption: "Failed episodes by class, % of all episodes of all seeds.".into(), columns, rows };
    Some(Block::Details("How episodes failed".into(), vec![Block::Table(table), Block::List(meanings)]))
}

/// The command and what it has taken.
pub fn how_made(finished: &Finished) -> Block {
    let experiment = &finished.experiment;
    let (done, all) = (finished.runs.len(), finished.grid.runs.len());
    let steps = finished.grid.steps.iter().zip(&finished.contents).filter(|(_, content)| content.is_some());
    let wall_s: f64 = steps.clone().filter_map(|(step, _)| wall_s_of(&step.log)).sum();
    let runs: Vec<u64> = finished.runs.iter().map(|m| m.run.seed).collect();
    let mut episodes: Vec<u64> = finished.runs.iter().map(|m| m.summary.episodes).collect();
    episodes.sort_unstable();
    episodes.dedup();
    let episodes = listed(&episodes.iter().map(u64::to_string).collect::<Vec<_>>());
    let methods: Vec<String> = experiment.methods.iter().map(|method| method.name().into()).collect();
    let comes_with_hilt = experiment.path.parent() == Some(Path::new(DIRECTORY));
    let name = if comes_with_hilt { experiment.name.clone() } else { experiment.path.display().to_string() };
    let (there, asked) = (seeds(&runs), seeds(&experiment.seeds));
    let plural = if experiment.presets.len() == 1 { "preset" } else { "presets" };
    Block::Words(format!(
        "Made by `hilt experiment {name}`: {plural} {}, {} {}, seeds {}, {episodes} episodes an evaluation; {done} of {all} runs finished; \
         {} steps took {} of wall time, added up.",
        listed(&experiment.presets),
        if methods.len() == 1 { "method" } else { "methods" },
        listed(&methods),
        if there == asked { there } else { format!("{there} of {asked}") },
        steps.count(),
        in_words(wall_s),
    ))
}
