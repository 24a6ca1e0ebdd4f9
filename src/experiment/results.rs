//! What an experiment comes to, as CSV: a row a run, in the order of its file; the same runs give the same bytes. Wall times are in a table of
//! their own.

use super::estimate::wall_s_of;
use super::runs::{Grid, Run};
use super::state::Contents;
use super::step::Step;
use super::wording::TAKES;
use crate::data::{json_file, table_file};
use crate::error::{Error, Result};
use crate::eval::Summary;
use crate::table::{Table, Values};
use crate::tasks::FailureClass;
use std::fmt::Write;

/// File of the results in an experiment's directory.
pub const RESULTS: &str = "results.csv";
/// File of the wall times there.
pub const TIMES: &str = "times.csv";
/// What the lines of results have before the failure classes.
const COLUMNS: &str = "task,preset,variation,method,seed,episodes,successes,success_rate,wilson_95_low,wilson_95_high,updates";

/// The first line of the results.
pub fn header() -> String {
    let classes = FailureClass::ALL.map(FailureClass::name).join(",");
    format!("{COLUMNS},{classes},directory\n")
}

/// One finished run.
pub struct Row<'a> {
    /// The run.
    pub run: &'a Run,
    /// Its evaluation.
    pub summary: Summary,
    /// Updates of the policy, warm start included.
    pub updates: u64,
    /// What was known after each epoch of its training.
    pub metrics: Table,
}

/// The finished runs of a grid.
///
/// # Errors
/// What reading them returns.
pub fn rows<'a>(grid: &'a Grid, contents: &Contents) -> Result<Vec<Row<'a>>> {
    let finished = grid.runs.iter().filter(|run| contents[run.evaluate].is_some());
    finished.map(|run| row(run, &grid.steps[run.train], &grid.steps[run.evaluate])).collect()
}

fn row<'a>(run: &'a Run, train: &Step, evaluate: &Step) -> Result<Row<'a>> {
    let (content, _) = json_file::read(evaluate.artefact())?;
    let summary = serde_json::from_value(content);
    let summary: Summary =
        summary.map_err(|e| Error::input(evaluate.artefact(), format!("is no summary of an evaluation: {e}")))?;
    let path = &train.outputs[1].path;
    let metrics = table_file::read(path)?.0;
    let updates = updates(&metrics).ok_or_else(|| Error::input(path, "counts no updates; train again"))?;
    Ok(Row { run, summary, updates, metrics })
}

/// Updates of all stages of a training, by its metrics: each stage counts from 1, so the last of each. `None` for another table.
fn updates(metrics: &Table) -> Option<u64> {
    let (Values::Text(stages), Values::I64(updates)) = (&metrics.column("stage")?.values, &metrics.column("updates")?.values)
    else {
        return None;
    };
    let last_of_stage = |i: &usize| stages.get(i + 1).is_none_or(|next| *next != stages[*i]);
    Some((0..stages.len()).filter(last_of_stage).map(|i| updates[i].max(0).cast_unsigned()).sum())
}

/// The results as CSV.
pub fn to_csv(rows: &[Row], grid: &Grid) -> String {
    let mut text = header();
    for Row { run, summary, updates, .. } in rows {
        let (task, preset, variation, method, seed) = (&run.task, &run.preset, &run.variation, run.method.name(), run.seed);
        let Summary { episodes, successes, success_rate, wilson_95: [low, high], failures, .. } = summary;
        let classes = FailureClass::ALL.map(|class| failures.get(class.name()).copied().unwrap_or(0).to_string()).join(",");
        let directory = grid.steps[run.evaluate].id.trim_end_matches("/evaluate");
        writeln!(
            text,
            "{task},{preset},{variation},{method},{seed},{episodes},{successes},{success_rate},{low},{high},{updates},{classes},{directory}"
        )
        .expect(TAKES);
    }
    text
}

/// Wall times of the finished steps, by their logs. They differ from run to run.
pub fn times_csv(grid: &Grid, contents: &Contents) -> String {
    let mut text = "step,stage,task,seed,wall_s\n".to_string();
    for (step, _) in grid.steps.iter().zip(contents).filter(|(_, content)| content.is_some()) {
        if let Some(wall_s) = wall_s_of(&step.log) {
            let Step { id, stage, task, seed, .. } = step;
            writeln!(text, "{id},{},{task},{seed},{wall_s}", stage.name()).expect(TAKES);
        }
    }
    text
}
