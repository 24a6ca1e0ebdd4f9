//! What a report makes of an experiment's runs.

use crate::words::unknown;
use std::str::FromStr;

/// Key `report` of an experiment's file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ReportKind {
    /// Success of every variation and method: what an experiment has that says nothing.
    #[default]
    Success,
    /// The paper's Table 2 beside ours: variations by name, success and time.
    Table2,
    /// The paper's Table 3 beside ours: variations by name, success.
    Table3,
    /// The paper's Figure 6: d_conv over the epochs.
    Convergence,
    /// The paper's Figure 7: success over epochs, environment steps and time, a curve a method.
    Training,
    /// The paper's Figure 8: the block's paths, of an experiment with `record = true`.
    Paths,
    /// Variations of which each extends one before: success and what each adds.
    Ladder,
    /// Success over the number of demos (`convert.demos`), a curve a method.
    Demos,
}

impl ReportKind {
    /// All of them.
    pub const ALL: [ReportKind; 8] = [
        ReportKind::Success,
        ReportKind::Table2,
        ReportKind::Table3,
        ReportKind::Convergence,
        ReportKind::Training,
        ReportKind::Paths,
        ReportKind::Ladder,
        ReportKind::Demos,
    ];

    /// As a file has it.
    pub fn name(self) -> &'static str {
        ["success", "table2", "table3", "convergence", "training", "paths", "ladder", "demos"][self as usize]
    }
}

impl FromStr for ReportKind {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let known = ReportKind::ALL.map(ReportKind::name);
        ReportKind::ALL.into_iter().find(|kind| kind.name() == word).ok_or_else(|| unknown("report", word, &known))
    }
}
