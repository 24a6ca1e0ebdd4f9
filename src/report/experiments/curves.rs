//! Columns of training metrics over epochs, and means over seeds.

use super::finished::Measured;
use crate::report::chart::Point;
use crate::report::statistics::average;
use crate::table::{Table, Values};

/// A column of numbers; `None` when the table has none of this name.
pub fn numbers(metrics: &Table, name: &str) -> Option<Vec<f64>> {
    match &metrics.column(name)?.values {
        Values::F64(v) => Some(v.clone()),
        Values::I64(v) => Some(v.iter().map(|x| *x as f64).collect()),
        _ => None,
    }
}

/// Mean and extremes over runs of a column, an epoch each, as far as all runs go; epochs count from 1, warm start included. Empty where no run
/// has a number of this name.
pub fn over_epochs(runs: &[&Measured], name: &str) -> Vec<Point> {
    let columns: Vec<Vec<f64>> = runs.iter().filter_map(|m| numbers(&m.metrics, name)).collect();
    let epochs = columns.iter().map(Vec::len).min().unwrap_or(0);
    let at = |epoch: usize| {
        let values: Vec<f64> = columns.iter().map(|column| column[epoch]).collect();
        let value = average(&values);
        let interval = [values.iter().copied().fold(f64::MAX, f64::min), values.iter().copied().fold(f64::MIN, f64::max)];
        Point { x: (epoch + 1) as f64, value, interval, singles: Vec::new() }
    };
    (0..epochs).map(at).filter(|point| point.value.is_finite()).collect()
}
