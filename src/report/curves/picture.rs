//! Curves as SVG, of the family of all charts.

use super::model::Plot;
use crate::report::chart::{FreeLine, FreePanel, LOOKS, Panels, Picture};

/// A picture with a panel for each plot.
pub fn picture(id: &str, title: &str, plots: &[Plot]) -> Picture {
    let line =
        |curve: &super::Curve| FreeLine { name: curve.name.clone(), look: curve.source % LOOKS, points: curve.points.clone() };
    let panel = |plot: &Plot| FreePanel {
        title: plot.metric.clone(),
        log: plot.log,
        parts: plot.stages.clone(),
        lines: plot.curves.iter().map(line).collect(),
    };
    let metrics: Vec<&str> = plots.iter().map(|plot| plot.metric.as_str()).collect();
    Panels {
        id: id.into(),
        title: title.into(),
        description: format!("Curves over the epochs of training, a panel for each of {}", metrics.join(", ")),
        note: "each stage of training is as wide as the next; the number behind its name is its epochs".into(),
        panels: plots.iter().map(panel).collect(),
    }
    .draw()
}
