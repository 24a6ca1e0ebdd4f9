//! The paper's Figure 6: d_conv over the epochs.

use super::curves::over_epochs;
use super::finished::{Arm, Finished, Measured};
use crate::report::chart::{Axis, Chart, LOOKS, Panel, Point, Series};
use crate::report::page::{Block, Cell, Column, Table};

/// The column of the metrics.
const D_CONV: &str = "d_conv";

/// Curves, and their beginnings and ends.
pub fn blocks(finished: &Finished) -> Vec<Block> {
    let arms = finished.arms();
    let curve = |arm: &Arm, task: &str| over_epochs(&finished.of(*arm, task).collect::<Vec<&Measured>>(), D_CONV);
    let panel = |task: &&str| {
        let series = arms.iter().enumerate().map(|(i, arm)| Series {
            name: finished.label(*arm),
            look: i % LOOKS,
            points: curve(arm, task),
            dense: true,
        });
        Panel { title: task.to_string(), series: series.filter(|series| !series.points.is_empty()).collect() }
    };
    let panels: Vec<Panel> = finished.tasks().iter().map(panel).filter(|panel| !panel.series.is_empty()).collect();
    if panels.is_empty() {
        return vec![Block::Words("No finished training has a column `d_conv`.".into())];
    }
    let chart = Chart {
        id: format!("{}-convergence", finished.experiment.name),
        title: "Degree of policy convergence over training".into(),
        description: "Curves of d_conv over the epochs, a panel for each task; the table below has their beginnings and ends"
            .into(),
        x_label: "epochs, warm start included".into(),
        y_label: "d_conv".into(),
        note: "lines: mean over seeds; bands: lowest to highest seed".into(),
        x: Axis::Log,
        percent: false,
        panels,
    };
    let caption = "d_conv (Eq. 4), mean over the updates of an epoch, over the epochs of training: the paper's Figure 6, which plots it for HIL on each task.";
    vec![Block::Figure(chart.draw(), caption.into()), Block::Table(table(finished, &arms, curve))]
}

fn table(finished: &Finished, arms: &[Arm], curve: impl Fn(&Arm, &str) -> Vec<Point>) -> Table {
    let mut rows = Vec::new();
    for arm in arms {
        for task in finished.tasks() {
            let points = curve(arm, task);
            if let (Some(first), Some(last)) = (points.first(), points.last()) {
                let half = points.iter().find(|p| p.value >= (first.value + last.value) / 2.0).map_or(last.x, |p| p.x);
                let highest = points.iter().map(|p| p.value).fold(0.0, f64::max);
                let numbers = [first.value, last.value, highest].map(|v| format!("{v:.3}"));
                let mut cells = [finished.label(*arm), task.to_string(), format!("{:.0}", last.x)].map(Cell::from).to_vec();
                cells.extend(numbers.map(Cell::from));
                cells.push(format!("{half:.0}").into());
                rows.push(cells);
            }
        }
    }
    let columns = vec![
        Column::words(""),
        Column::words("task"),
        Column::number("epochs"),
        Column::number("d_conv, first"),
        Column::number("last"),
        Column::number("highest"),
        Column::number("half way at epoch"),
    ];
    Table { caption: "d_conv at the first and the last epoch, mean over seeds.".into(), columns, rows }
}
