//! Results as CSV: labels of the study, method, seed, counts, times.

use crate::chain::Trained;
use anyhow::{Context, Result, ensure};
use hilt::data::atomic;
use hilt::eval::Summary;
use hilt::tasks::FailureClass;
use std::fs;
use std::path::Path;

/// Columns behind the labels of the study; the failure classes stand between the two groups.
const COUNTS: [&str; 4] = ["method", "seed", "successes", "episodes"];
const COSTS: [&str; 4] = ["seconds_pretrain", "seconds_train", "wall_seconds", "updates"];

/// One policy and how it did. Values are numbers and plain words, so no cell needs quotes.
#[derive(Clone, Debug)]
pub struct Row {
    labels: Vec<String>,
    values: Vec<String>,
}

impl Row {
    /// `labels`: name and value of what the study varies.
    pub fn of(labels: &[(&str, String)], seed: u64, trained: &Trained, summary: &Summary) -> Row {
        let mut values: Vec<String> = labels.iter().map(|(_, value)| value.clone()).collect();
        values.extend([trained.method.name().into(), seed.to_string()]);
        values.extend([summary.successes, summary.episodes].map(|n| n.to_string()));
        values.extend(FailureClass::ALL.map(|class| summary.failures[class.name()].to_string()));
        values.extend([trained.pretrain_s, trained.policy.cpu_s, trained.wall_s].map(|s| format!("{s:.2}")));
        values.push(trained.updates.to_string());
        Row { labels: labels.iter().map(|(name, _)| name.to_string()).collect(), values }
    }
}

/// Writes the rows of all cells; an old file stays until the new one is whole.
pub fn write(path: &Path, cells: &[Vec<Row>]) -> Result<()> {
    let rows: Vec<&Row> = cells.iter().flatten().collect();
    let Some(first) = rows.first() else { return Ok(()) };
    let classes = FailureClass::ALL.map(FailureClass::name);
    let header = first.labels.iter().map(String::as_str).chain(COUNTS).chain(classes).chain(COSTS);
    let mut text = header.collect::<Vec<_>>().join(",") + "\n";
    for row in rows {
        text += &(row.values.join(",") + "\n");
    }
    if let Some(dir) = path.parent() {
        fs::create_dir_all(dir).with_context(|| format!("cannot make {}", dir.display()))?;
    }
    Ok(atomic::write_bytes(path, text.as_bytes())?)
}

/// A row as it is read back: what tables and figures need of it.
#[derive(Clone, Debug)]
pub struct Counted {
    /// What the study varies, in the order of the columns.
    pub labels: Vec<String>,
    pub method: String,
    pub seed: u64,
    pub successes: u64,
    pub episodes: u64,
}

/// Reads a results file: the names of the labels, and the rows.
pub fn read(path: &Path) -> Result<(Vec<String>, Vec<Counted>)> {
    let text = fs::read_to_string(path).with_context(|| format!("cannot read {}: run the study first", path.display()))?;
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().unwrap_or_default();
    let at =
        |name: &str| header.iter().position(|h| *h == name).with_context(|| format!("{} has no column {name}", path.display()));
    let [method, seed, successes, episodes] = [at(COUNTS[0])?, at(COUNTS[1])?, at(COUNTS[2])?, at(COUNTS[3])?];
    let row = |(i, cells): (usize, Vec<&str>)| -> Result<Counted> {
        ensure!(
            cells.len() == header.len(),
            "{} row {}: {} cells under {} names",
            path.display(),
            i + 1,
            cells.len(),
            header.len()
        );
        let number = |column: usize| {
            let what = || format!("{} row {}: {} = {} is no count", path.display(), i + 1, header[column], cells[column]);
            cells[column].parse::<u64>().with_context(what)
        };
        Ok(Counted {
            labels: cells[..method].iter().map(|c| c.to_string()).collect(),
            method: cells[method].into(),
            seed: number(seed)?,
            successes: number(successes)?,
            episodes: number(episodes)?,
        })
    };
    let rows = lines.enumerate().map(row).collect::<Result<Vec<_>>>()?;
    Ok((header[..method].iter().map(|h| h.to_string()).collect(), rows))
}
