//! Success over the number of demos.

use super::finished::{Arm, Finished, look};
use crate::config::Stage;
use crate::report::chart::{Axis, Chart, Panel, Point, Series};
use crate::report::page::Block;

/// A figure with a panel for each task and each rest of the variations' names.
pub fn blocks(finished: &Finished) -> Vec<Block> {
    let arms = finished.arms();
    let experiment = &finished.experiment;
    let mut panels: Vec<Panel> = Vec::new();
    for preset in &experiment.presets {
        for task in finished.tasks() {
            let mut kinds: Vec<String> = Vec::new();
            for arm in arms.iter().filter(|arm| arm.preset == preset) {
                let kind = kind(arm, demos(finished, *arm, task));
                if !kinds.contains(&kind) {
                    kinds.push(kind);
                }
            }
            for kind in kinds {
                panels.extend(panel(finished, &arms, (preset, task, &kind)));
            }
        }
    }
    if panels.is_empty() {
        return vec![Block::Words("No finished run learned from demos of its own.".into())];
    }
    let chart = Chart {
        id: format!("{}-demos", experiment.name),
        title: "Success over the number of demos".into(),
        description: "Curves of success over the number of demos, a curve for each method; the table below has the numbers"
            .into(),
        x_label: "demos".into(),
        y_label: "success".into(),
        note: "markers: mean over seeds, with 95 % intervals; dots: single seeds".into(),
        x: Axis::Log,
        percent: true,
        panels,
    };
    let caption =
        format!("Success over the number of demos, all methods on the same demos. {}", super::common::intervals(finished));
    vec![Block::Figure(chart.draw(), caption)]
}

fn panel(finished: &Finished, arms: &[Arm], (preset, task, of): (&str, &str, &str)) -> Option<Panel> {
    let series = finished.experiment.methods.iter().filter_map(|method| {
        let mut points: Vec<Point> = Vec::new();
        let arms = arms.iter().filter(|arm| (arm.preset, arm.method) == (preset, *method));
        for arm in arms {
            let count = demos(finished, *arm, task);
            if let (Some(x), Some(success)) = (count, finished.success(*arm, task).filter(|_| kind(arm, count) == of)) {
                let singles = finished.singles(*arm, task);
                points.push(Point { x: x as f64, value: success.value, interval: success.interval, singles });
            }
        }
        points.sort_by(|a, b| a.x.total_cmp(&b.x));
        (!points.is_empty()).then(|| Series { name: method.name().into(), look: look(*method), points, dense: false })
    });
    let series: Vec<Series> = series.collect();
    let words = [task, of, if finished.experiment.presets.len() > 1 { preset } else { "" }];
    let title = words.into_iter().filter(|word| !word.is_empty()).collect::<Vec<_>>().join(", ");
    (!series.is_empty()).then_some(Panel { title, series })
}

/// Demos that the runs of an arm learned from, as their settings have it.
fn demos(finished: &Finished, arm: Arm, task: &str) -> Option<u64> {
    let run = &finished.of(arm, task).next()?.run;
    let mut at = run.train;
    let steps = &finished.grid.steps;
    while steps[at].stage != Stage::Convert {
        at = steps[at].inputs.iter().find(|input| input.role == "dataset")?.from?;
    }
    steps[at].provenance.settings["convert"]["demos"].as_u64()
}

/// What a variation's name says beside the number of demos: `masked` of `10-masked`.
fn kind(arm: &Arm, demos: Option<u64>) -> String {
    let number = demos.map(|n| n.to_string()).unwrap_or_default();
    let rest = arm.variation.strip_prefix(&number).or_else(|| arm.variation.strip_suffix(&number)).unwrap_or(arm.variation);
    rest.trim_matches('-').to_string()
}
