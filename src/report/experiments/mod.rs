//! Pages of finished experiments: a section each, in the form that its file asks for (key `report`).

mod common;
mod comparisons;
mod convergence;
mod curves;
mod demos;
mod finished;
mod paper_table;
mod paths;
mod section;
mod tables;
mod training;
mod words;

pub use finished::{Arm, Finished, Measured};
pub use section::section;
pub use tables::run_table;

use super::page::{Block, Page, Section};
use std::path::Path;

/// The page of some experiments; `left_out` says which are not on it, and why.
pub fn page(sections: Vec<Section>, left_out: &[String]) -> Page {
    let mut lead = vec![Block::Words(
        "What the finished runs of these experiments come to. hilt implements Jung & Kim, Hybrid Imitation Learning Framework for Robotic Manipulation \
         Tasks, Sensors 2021; where the paper has numbers, they stand beside ours. They were measured in another simulator, so what compares is order and \
         distance, not the last digit."
            .into(),
    )];
    if !left_out.is_empty() {
        lead.extend([Block::Words("Not on this page:".into()), Block::List(left_out.to_vec())]);
    }
    let mut sections = sections;
    sections.push(Section { id: "how-to-read".into(), title: "How to read this page".into(), blocks: how_to_read() });
    Page { title: "hilt: results".into(), lead, sections }
}

/// Whether a path below a report's directory is one that a report has.
pub fn is_file(path: &Path) -> bool {
    let ending = path.extension().and_then(|e| e.to_str());
    let top = path.components().next().and_then(|c| c.as_os_str().to_str());
    match (top, ending) {
        (Some("index.html" | "report.md"), _) => path.components().count() == 1,
        (Some("figures"), Some("svg")) | (Some("tables"), Some("parquet")) => true,
        _ => false,
    }
}

fn how_to_read() -> Vec<Block> {
    let items = [
        "Success is the share of evaluation episodes that were solved. No episode of an evaluation was among the demos or had a say in training.",
        "A seed sets demos, training and evaluation. Means are over seeds, then over tasks. Their 95 % intervals come from the percentile bootstrap over seeds \
         (10,000 draws, seeded), within each task where there are several (stratified), as in Agarwal et al., Deep Reinforcement Learning at the Edge of the \
         Statistical Precipice, NeurIPS 2021 (rliable). They say nothing of other tasks.",
        "The interquartile mean is the mean of the middle half of all seeds of all tasks.",
        "A single policy has the Wilson 95 % interval of its episodes.",
        "The probability of improvement is that of a policy of the first method doing better than one of the second on the same task, mean over tasks; a tie counts half.",
        "The difference is over pairs: the same seed of both, which share what does not differ between them, demos and evaluation episodes included.",
        "Two methods are told apart only if the interval of the probability of improvement leaves out .5 and that of the difference leaves out 0. With fewer than three \
         seeds nothing is told apart; with fewer than five, bootstrap intervals are narrower than they should be.",
        "Wall times are those of the logs, on the machine and with the threads of the runs.",
        "The tables of all runs are beside this page, in `tables`, a Parquet file for each experiment and task; the figures are in `figures`, and the same words in `report.md`.",
    ];
    vec![Block::List(items.map(String::from).to_vec())]
}
