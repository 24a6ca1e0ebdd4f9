//! From results to a figure and to tables. Seeds are pooled: all their episodes count alike.

use crate::Args;
use crate::results::{Counted, read};
use anyhow::{Result, ensure};
use hilt::data::atomic;
use hilt::eval::wilson_95;
use hilt::report::chart::{Axis, Chart, Panel, Point, Series};

/// Methods in the order of legends and columns, with their names.
const METHODS: [(&str, &str); 3] = [("bc", "BC"), ("sc", "SC"), ("hil", "HIL")];
/// Titles of the panels, by the label `features`.
const PANELS: [(&str, &str); 3] = [("best", "default inputs"), ("masked", "without joint velocities"), ("raw", "raw state")];

/// Successes and episodes of all seeds.
fn pooled<'a>(rows: impl Iterator<Item = &'a Counted>) -> (u64, u64) {
    rows.fold((0, 0), |(successes, episodes), r| (successes + r.successes, episodes + r.episodes))
}

fn rate(successes: u64, episodes: u64) -> f64 {
    successes as f64 / episodes.max(1) as f64
}

/// Values of a column in the order of their first row.
fn distinct<T: PartialEq>(values: impl Iterator<Item = T>) -> Vec<T> {
    values.fold(Vec::new(), |mut seen, value| {
        if !seen.contains(&value) {
            seen.push(value);
        }
        seen
    })
}

/// Success over the number of demos, a panel for each choice of features.
pub fn figure(args: &Args) -> Result<()> {
    let csv = args.csv_of("few-demos");
    let (names, rows) = read(&csv)?;
    ensure!(names == ["demos", "features"], "{} is not a result of few-demos: it varies {names:?}", csv.display());
    let mut demos = distinct(rows.iter().map(|r| r.labels[0].clone()));
    demos.sort_by_key(|d| d.parse::<u64>().unwrap_or(u64::MAX));
    let series = |features: &str, look: usize| {
        let (method, name) = METHODS[look];
        let of =
            |d: &String| rows.iter().filter(|r| r.labels == [d.as_str(), features] && r.method == method).collect::<Vec<_>>();
        let points = demos.iter().enumerate().filter_map(|(at, d)| {
            let x = at as f64;
            let rows = of(d);
            let (successes, episodes) = pooled(rows.iter().copied());
            let singles = rows.iter().map(|r| rate(r.successes, r.episodes)).collect();
            let interval = wilson_95(successes, episodes);
            (episodes > 0).then(|| Point { x, value: rate(successes, episodes), interval, singles })
        });
        Series { name: name.into(), look, points: points.collect(), dense: false }
    };
    let panels = PANELS.iter().filter(|(features, _)| rows.iter().any(|r| r.labels[1] == *features)).map(|(features, title)| {
        let series = (0..METHODS.len()).map(|look| series(features, look));
        Panel { title: (*title).into(), series: series.collect() }
    });
    let chart = Chart {
        id: "few-demos".into(),
        title: "Stack: success over the number of demos".into(),
        description: "Curves of success of BC, SC and HIL over the number of demos, a panel for each choice of inputs".into(),
        x_label: "demos".into(),
        y_label: "success".into(),
        note: "lines: all seeds, with Wilson 95 % intervals; dots: single seeds".into(),
        x: Axis::Categories(demos.clone()),
        percent: true,
        panels: panels.collect(),
    };
    atomic::write_bytes(&args.picture, chart.draw().to_svg().as_bytes())?;
    eprintln!("wrote {}", args.picture.display());
    Ok(())
}

/// A line for each combination of labels, a column for each method.
pub fn table(args: &Args) -> Result<()> {
    let (names, rows) = read(&args.csv_of("few-demos"))?;
    let methods: Vec<_> = METHODS.iter().filter(|(method, _)| rows.iter().any(|r| r.method == *method)).collect();
    let both = ["bc", "hil"].iter().all(|method| methods.iter().any(|(m, _)| m == method));
    let mut head: Vec<&str> = names.iter().map(String::as_str).collect();
    head.extend(methods.iter().map(|(_, name)| *name));
    head.extend(both.then_some("HIL - BC, points (seeds)"));
    println!("| {} |\n|{}", head.join(" | "), "---|".repeat(head.len()));
    for labels in distinct(rows.iter().map(|r| r.labels.clone())) {
        let of = |method: &str| rows.iter().filter(|r| r.labels == labels && r.method == method).collect::<Vec<_>>();
        let mut cells = labels.clone();
        cells.extend(methods.iter().map(|(method, _)| success(&of(method))));
        cells.extend(both.then(|| difference(&of("hil"), &of("bc"))));
        println!("| {} |", cells.join(" | "));
    }
    Ok(())
}

/// "97.1 % [96.4, 97.7]", pooled.
fn success(rows: &[&Counted]) -> String {
    let (successes, episodes) = pooled(rows.iter().copied());
    let [low, high] = wilson_95(successes, episodes).map(|v| 100.0 * v);
    if episodes == 0 { "-".into() } else { format!("{:.1} % [{low:.1}, {high:.1}]", 100.0 * rate(successes, episodes)) }
}

/// Mean over the seeds that both have, and each seed's own.
fn difference(hil: &[&Counted], bc: &[&Counted]) -> String {
    let points = |r: &Counted| 100.0 * rate(r.successes, r.episodes);
    let pairs = hil.iter().filter_map(|h| bc.iter().find(|b| b.seed == h.seed).map(|b| points(h) - points(b)));
    let gaps: Vec<f64> = pairs.collect();
    let mean = gaps.iter().sum::<f64>() / gaps.len().max(1) as f64;
    let each: Vec<String> = gaps.iter().map(|g| format!("{g:+.1}")).collect();
    if gaps.is_empty() { "-".into() } else { format!("{mean:+.1} ({})", each.join(", ")) }
}
