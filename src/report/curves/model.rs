//! What is drawn: for each metric a plot, in it a curve for each training that has it.
//!
//! A stage of training is as wide as the next, however many epochs it has: a warm start of thousands of epochs would leave no room for what follows.

use super::sources::{PLACE, Source, numbers};
use crate::table::{Table, Values};
use crate::words::did_you_mean;

/// Metrics that are drawn where none is named, in this order; of a training that has none of them, all of its own.
const FIRST: [&str; 11] = [
    "d_conv",
    "alpha",
    "l_bc",
    "validation_l_bc",
    "l_sc",
    "l_mix",
    "grad_bc",
    "grad_sc",
    "l_model",
    "validation_l_model",
    "learning_rate",
];
/// A metric that falls or grows by more than this is drawn over its logarithm.
const WIDE: f64 = 30.0;
/// The stage of tables of pretraining: nobody compares them with those of training.
const PRETRAIN: &str = "pretrain";

/// One metric.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    /// Its column.
    pub metric: String,
    /// What it is.
    pub doc: String,
    /// Whether the vertical axis is logarithmic.
    pub log: bool,
    /// Lowest and highest value.
    pub range: [f64; 2],
    /// Names of the stages with their epochs, each one wide: the horizontal axis ends at their number.
    pub stages: Vec<String>,
    /// A curve a training.
    pub curves: Vec<Curve>,
}

/// One training.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// The number of its source.
    pub source: usize,
    /// Its name.
    pub name: String,
    /// Places on the horizontal axis and values, from the left.
    pub points: Vec<[f64; 2]>,
}

/// The plots of some trainings; of these `metrics`, where any is named.
///
/// # Errors
/// Says which metric none of them has, and which there are.
pub fn plots(sources: &[Source], metrics: &[String]) -> Result<Vec<Plot>, String> {
    let of = |pretraining: bool| {
        let kind = |source: &&(usize, &Source)| stages(&source.1.metrics).iter().any(|(name, _)| name == PRETRAIN) == pretraining;
        let all: Vec<(usize, &Source)> = sources.iter().enumerate().collect();
        all.iter().filter(kind).copied().collect::<Vec<_>>()
    };
    let groups = [of(false), of(true)];
    let known: Vec<&str> = sources.iter().flat_map(|source| known(&source.metrics)).collect();
    if let Some(unknown) = metrics.iter().find(|metric| !known.contains(&metric.as_str())) {
        let mut names = known.clone();
        names.sort_unstable();
        names.dedup();
        let hint = did_you_mean(unknown, names.iter().copied());
        return Err(format!("--metric {unknown}: none of these trainings has it{hint}; there are: {}", names.join(", ")));
    }
    let mut plots = Vec::new();
    for group in groups.iter().filter(|group| !group.is_empty()) {
        let stages = axis(group);
        for metric in chosen(group, metrics) {
            plots.extend(plot(&metric, group, &stages));
        }
    }
    Ok(plots)
}

/// Columns that are metrics and have a number.
fn known(table: &Table) -> impl Iterator<Item = &str> {
    let has_any = |values: &Values| numbers(values).is_some_and(|values| values.iter().any(|v| v.is_finite()));
    table
        .columns
        .iter()
        .filter(move |column| !PLACE.contains(&column.name.as_str()) && has_any(&column.values))
        .map(|column| column.name.as_str())
}

fn chosen(group: &[(usize, &Source)], named: &[String]) -> Vec<String> {
    let has = |metric: &str| group.iter().any(|(_, source)| known(&source.metrics).any(|name| name == metric));
    if !named.is_empty() {
        return named.iter().filter(|metric| has(metric)).cloned().collect();
    }
    let usual: Vec<String> =
        FIRST.into_iter().filter(|metric| *metric != "learning_rate" && has(metric)).map(String::from).collect();
    if !usual.is_empty() {
        return usual;
    }
    let mut all: Vec<String> = Vec::new();
    for name in group.iter().flat_map(|(_, source)| known(&source.metrics)) {
        if !all.iter().any(|known| known == name) {
            all.push(name.into());
        }
    }
    all
}

/// Stages of a training in order, with the last epoch of each.
fn stages(table: &Table) -> Vec<(String, i64)> {
    let (Some(Values::Text(names)), Some(Values::I64(epochs))) =
        (table.column("stage").map(|c| &c.values), table.column("epoch").map(|c| &c.values))
    else {
        return Vec::new();
    };
    let mut found: Vec<(String, i64)> = Vec::new();
    for (name, epoch) in names.iter().zip(epochs) {
        match found.last_mut() {
            Some((last, most)) if last == name => *most = (*most).max(*epoch),
            _ => found.push((name.clone(), *epoch)),
        }
    }
    found
}

/// A stage of several trainings: what it is called in each, and its epochs in the longest.
type Stage = (Vec<String>, i64);

fn axis(group: &[(usize, &Source)]) -> Vec<Stage> {
    let mut axis: Vec<Stage> = Vec::new();
    for (_, source) in group {
        for (at, (name, epochs)) in stages(&source.metrics).into_iter().enumerate() {
            if at == axis.len() {
                axis.push((Vec::new(), 1));
            }
            let (names, most) = &mut axis[at];
            if !names.contains(&name) {
                names.push(name);
            }
            *most = (*most).max(epochs);
        }
    }
    axis
}

fn plot(metric: &str, group: &[(usize, &Source)], stages: &[Stage]) -> Option<Plot> {
    let curves: Vec<Curve> = group.iter().filter_map(|(at, source)| curve(metric, *at, source, stages)).collect();
    let values = || curves.iter().flat_map(|curve| &curve.points).map(|point| point[1]);
    let range = values().fold([f64::MAX, f64::MIN], |[low, high], v| [low.min(v), high.max(v)]);
    let doc = group.iter().find_map(|(_, source)| source.metrics.column(metric)).map(|column| column.doc.clone());
    let stages = stages.iter().map(|(names, epochs)| format!("{} {epochs}", names.join("/"))).collect();
    let log = range[0] > 0.0 && range[1] / range[0] > WIDE;
    (!curves.is_empty()).then(|| Plot { metric: metric.into(), doc: doc.unwrap_or_default(), log, range, stages, curves })
}

fn curve(metric: &str, at: usize, source: &Source, stages: &[Stage]) -> Option<Curve> {
    let table = &source.metrics;
    let values = numbers(&table.column(metric)?.values)?;
    let (Values::Text(names), Values::I64(epochs)) = (&table.column("stage")?.values, &table.column("epoch")?.values) else {
        return None;
    };
    let (mut stage, mut points) = (0, Vec::new());
    for (row, value) in values.iter().enumerate() {
        if row > 0 && names[row] != names[row - 1] {
            stage += 1;
        }
        let longest = stages.get(stage).map_or(1, |(_, epochs)| *epochs).max(1);
        if value.is_finite() {
            points.push([stage as f64 + epochs[row] as f64 / longest as f64, *value]);
        }
    }
    (!points.is_empty()).then(|| Curve { source: at, name: source.name.clone(), points })
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use std::path::PathBuf;

    pub fn source(name: &str, stages: &[(&str, i64)], value: fn(f64) -> f64) -> Source {
        let rows: Vec<(String, i64)> =
            stages.iter().flat_map(|(name, n)| (1..=*n).map(|epoch| (name.to_string(), epoch))).collect();
        let metrics = Table::default()
            .with("stage", "", Values::Text(rows.iter().map(|row| row.0.clone()).collect()))
            .with("epoch", "", Values::I64(rows.iter().map(|row| row.1).collect()))
            .with("updates", "", Values::I64(rows.iter().map(|row| row.1).collect()))
            .with("l_bc", "L_BC", Values::F64((0..rows.len()).map(|row| value(row as f64)).collect()))
            .with("l_sc", "L_SC", Values::F64(vec![f64::NAN; rows.len()]));
        Source { path: PathBuf::from(name), name: name.into(), metrics }
    }

    #[test]
    fn every_stage_is_as_wide_as_the_next_and_runs_share_the_axis() {
        let sources = [
            source("hil", &[("warm-start", 4), ("hil", 2)], |x| 1.0 + x),
            source("bc", &[("warm-start", 4), ("bc", 4)], |x| 100.0 + x),
        ];
        let found = plots(&sources, &[]).expect("plots");
        assert_eq!(found.len(), 1, "a metric without any number is no plot");
        let plot = &found[0];
        assert_eq!((plot.metric.as_str(), plot.log, plot.range), ("l_bc", true, [1.0, 107.0]));
        assert_eq!(plot.stages, ["warm-start 4", "hil/bc 4"]);
        let places = |at: usize| plot.curves[at].points.iter().map(|point| point[0]).collect::<Vec<_>>();
        assert_eq!(places(0), [0.25, 0.5, 0.75, 1.0, 1.25, 1.5]);
        assert_eq!(places(1).last(), Some(&2.0));
    }

    #[test]
    fn an_unknown_metric_is_refused_with_the_nearest() {
        let why = plots(&[source("hil", &[("hil", 2)], |x| x)], &["l_bd".into()]).expect_err("refused");
        assert_eq!(why, "--metric l_bd: none of these trainings has it; did you mean l_bc?; there are: l_bc");
    }
}
