//! What the paper states: Jung & Kim, *Hybrid Imitation Learning Framework for Robotic Manipulation Tasks*, Sensors 2021, section 4.3.
//!
//! The paper names no numbers of runs or intervals beside the tables; Table 3 is "the average success rate from 10 runs". Its times were taken on
//! an Intel i9-7920X with a GeForce GTX 2080 Ti, with another simulator.

use crate::experiment::ReportKind;

/// Names of the paper's tasks, in the order of its columns.
pub const TASKS: [&str; 3] = ["pick-up", "pick-and-place", "stack"];

/// A table of the paper.
#[derive(Clone, Copy, Debug)]
pub struct PaperTable {
    /// Its name.
    pub name: &'static str,
    /// What its rows vary.
    pub varies: &'static str,
    /// Whether it has times.
    pub timed: bool,
    /// Its rows.
    pub rows: &'static [PaperRow],
}

/// One of its rows.
#[derive(Clone, Copy, Debug)]
pub struct PaperRow {
    /// The variation that is the same in an experiment.
    pub variation: &'static str,
    /// As the paper has it.
    pub label: &'static str,
    /// Success rates of [`TASKS`]; `None` = "failed", a dash in the table.
    success: [Option<f64>; 3],
    /// Learning times \[min\].
    minutes: Option<[f64; 3]>,
}

impl PaperRow {
    /// Success rate of a task; `None` = "failed", or no task of the paper.
    pub fn success(&self, task: &str) -> Option<f64> {
        self.success[column(task)?]
    }

    /// Learning time of a task \[min\].
    pub fn minutes(&self, task: &str) -> Option<f64> {
        Some(self.minutes?[column(task)?])
    }
}

/// The place of a task among those of the paper.
fn column(task: &str) -> Option<usize> {
    TASKS.iter().position(|name| *name == task)
}

const fn timed(variation: &'static str, label: &'static str, of: [[f64; 2]; 3]) -> PaperRow {
    let [[a, s], [b, t], [c, u]] = of;
    PaperRow { variation, label, success: [Some(a), Some(b), Some(c)], minutes: Some([s, t, u]) }
}

const fn untimed(variation: &'static str, label: &'static str, success: [Option<f64>; 3]) -> PaperRow {
    PaperRow { variation, label, success, minutes: None }
}

/// Table 2: "Performance comparison among the methods using different loss mixing weights"; success rate and time \[min\], rho = 0.6.
const TABLE_2: PaperTable = PaperTable {
    name: "Table 2",
    varies: "loss mixing",
    timed: true,
    rows: &[
        timed("alpha-0", "α = 0 (BC)", [[0.58, 112.0], [0.48, 128.0], [0.16, 135.0]]),
        timed("alpha-0.3", "α = 0.3", [[0.75, 293.0], [0.52, 422.0], [0.46, 414.0]]),
        timed("alpha-0.6", "α = 0.6", [[0.72, 393.0], [0.78, 456.0], [0.72, 545.0]]),
        timed("alpha-1", "α = 1 (SC)", [[0.64, 460.0], [0.76, 625.0], [0.66, 724.0]]),
        timed("adaptive", "α = d_conv (HIL)", [[0.75, 119.0], [0.84, 156.0], [0.78, 181.0]]),
    ],
};

/// Table 3: "Performance comparison depending on the state recovery probability rho"; success rate.
const TABLE_3: PaperTable = PaperTable {
    name: "Table 3",
    varies: "recovery",
    timed: false,
    rows: &[
        untimed("rho-1", "ρ = 1", [Some(0.64), Some(0.46), Some(0.52)]),
        untimed("rho-0.6", "ρ = 0.6", [Some(0.75), Some(0.84), Some(0.78)]),
        untimed("rho-0.3", "ρ = 0.3", [Some(0.816), Some(0.75), Some(0.76)]),
        untimed("rho-0", "ρ = 0", [None; 3]),
    ],
};

/// The table that an experiment repeats, if it does.
pub fn table_of(kind: ReportKind) -> Option<&'static PaperTable> {
    match kind {
        ReportKind::Table2 => Some(&TABLE_2),
        ReportKind::Table3 => Some(&TABLE_3),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The abstract: "about a 2.6 times higher performance improvement than the pure BC and about a four times faster training time than the
    /// pure SC".
    #[test]
    fn the_tables_bear_out_the_abstract() {
        let of = |variation: &str| TABLE_2.rows.iter().find(|row| row.variation == variation).expect("a row");
        let sum = |pick: &dyn Fn(&'static str) -> Option<f64>| TASKS.into_iter().filter_map(pick).sum::<f64>();
        let minutes = |row: &PaperRow| sum(&|task| row.minutes(task));
        let ratio = minutes(of("alpha-1")) / minutes(of("adaptive"));
        assert!((ratio - 4.0).abs() < 0.1, "{ratio}");
        let gains = TASKS.map(|task| of("adaptive").success(task).zip(of("alpha-0").success(task)).map_or(0.0, |(h, b)| h / b));
        assert!((gains.iter().sum::<f64>() / 3.0 - 2.6).abs() < 0.15, "{gains:?}");
        assert!(TASKS.iter().all(|task| of("adaptive").success(task) == TABLE_3.rows[1].success(task)));
    }
}
