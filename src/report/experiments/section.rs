//! The section of one experiment.

use super::finished::Finished;
use super::{common, comparisons, convergence, demos, paper_table, paths, training};
use crate::error::Result;
use crate::experiment::ReportKind;
use crate::interrupt::Interrupt;
use crate::report::page::{Block, Section};
use crate::report::paper::table_of;

/// What is finished of an experiment, as its file asks to have it shown.
///
/// # Errors
/// What reading recordings and datasets returns; [`crate::error::Error::Interrupted`].
pub fn section(finished: &Finished, interrupt: &Interrupt) -> Result<Section> {
    let experiment = &finished.experiment;
    let mut blocks = common::head(finished);
    blocks.extend(match experiment.report {
        ReportKind::Table2 | ReportKind::Table3 => {
            table_of(experiment.report).map(|paper| paper_table::blocks(finished, paper)).unwrap_or_default()
        }
        ReportKind::Convergence => convergence::blocks(finished),
        ReportKind::Training => training::blocks(finished)?,
        ReportKind::Paths => paths::blocks(finished, interrupt)?,
        ReportKind::Demos => demos::blocks(finished),
        ReportKind::Success | ReportKind::Ladder => Vec::new(),
    });
    let by_rows = matches!(experiment.report, ReportKind::Success | ReportKind::Ladder | ReportKind::Table2 | ReportKind::Table3);
    if by_rows {
        let caption = format!("Success by task. {}", common::intervals(finished));
        blocks.push(Block::Figure(common::success_figure(finished), caption));
    }
    let table = Block::Table(common::success_table(finished));
    match experiment.report {
        ReportKind::Success | ReportKind::Ladder | ReportKind::Demos => blocks.push(table),
        _ => blocks.push(Block::Details("Success in numbers".into(), vec![table])),
    }
    if experiment.report != ReportKind::Paths {
        blocks.extend(common::aggregates(finished, &comparisons::arms(finished)));
        blocks.extend(comparisons::blocks(finished));
    }
    blocks.extend(common::failures(finished));
    blocks.push(common::how_made(finished));
    Ok(Section { id: experiment.name.clone(), title: experiment.description.clone(), blocks })
}
