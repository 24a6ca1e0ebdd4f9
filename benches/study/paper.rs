//! Preset `paper` on the three tasks: the chain of `make all PRESET=paper`, for several seeds.

use crate::Args;
use crate::chain::Method;
use crate::lab::{Lab, Setup, each};
use crate::results::{Row, write};
use anyhow::{Result, ensure};
use hilt::task::built_in::of_the_paper;
use hilt::tasks::Task;
use std::sync::Arc;

pub fn run(args: &Args) -> Result<()> {
    // BC from scratch in the time of HIL is no part of the preset: its warm start has no updates.
    ensure!(args.methods.iter().all(|m| *m == Method::Hil), "the preset paper is a preset of hil: leave --methods out");
    let (lab, csv) = (Lab { dir: args.dir.join("paper"), threads: args.threads }, args.csv_of("paper"));
    let seeds = args.seeds_or(0..3);
    let cells: Vec<(Arc<Task>, u64)> = seeds.iter().flat_map(|seed| of_the_paper().map(|task| (task, *seed))).collect();
    each(&cells, args.jobs, |(task, seed)| cell(args, &lab, task, *seed), |rows| write(&csv, rows))
}

fn cell(args: &Args, lab: &Lab, task: &Task, seed: u64) -> Result<Vec<Row>> {
    let pipeline = format!("pipelines/paper/{task}.toml").into();
    let setup = Setup { pipeline, sets: vec![format!("evaluate.episodes={}", args.episodes)], seed }.with(&args.set);
    let label = format!("{task}-seed-{seed}");
    let demos = lab.demos(&label, &setup)?;
    let trained = lab.hil(&label, &setup, &args.hil_set, &demos)?;
    Ok(vec![lab.evaluate(&label, &setup, &[("task", task.name.as_str().into())], &trained)?])
}
