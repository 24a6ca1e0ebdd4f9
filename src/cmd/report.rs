use super::experiment::{Chosen, parse_seeds};
use super::places::{Content, Places};
use super::{Context, Outcome};
use crate::data::{atomic, table_file};
use crate::error::{Error, Result};
use crate::experiment::{Experiment, Grid, Overrides, ReportKind, all, find, leftovers};
use crate::report::experiments::{Finished, is_file, page, run_table, section};
use crate::report::page::Page;
use std::path::{Path, PathBuf};

/// Write a page of finished experiments: HTML and Markdown, figures as SVG, runs as Parquet. Unfinished ones are shown as far as they are.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  hilt report --runs runs/experiments --out page")]
pub struct Args {
    /// Names of experiments in pipelines/experiments, or files [default: all there that have finished runs]
    #[arg(value_name = "NAME|FILE.toml")]
    names: Vec<String>,
    /// Directory with a directory of runs for each experiment
    #[arg(long, value_name = "DIR", default_value = super::experiment::EXPERIMENTS)]
    runs: PathBuf,
    /// Directory to write: index.html, report.md, figures, tables
    #[arg(long, value_name = "DIR", default_value = "runs/report")]
    out: PathBuf,
    /// Show these seeds only, of those that an experiment has: 0-4, 0,3
    #[arg(long, value_name = "SEEDS", value_parser = parse_seeds)]
    seeds: Option<Chosen>,
    /// Episodes of each evaluation, where hilt experiment was given them too
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u64).range(1..))]
    episodes: Option<u64>,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    Places::new().read(&args.runs).write("--out", &args.out, Content::Report).check(&context.console)?;
    let (shown, left_out) = if args.names.is_empty() { all_finished(args)? } else { (named(args)?, Vec::new()) };
    left_out.iter().for_each(|why| context.console.say(&format!("report: left out {why}")));
    if shown.is_empty() {
        let dir = args.runs.display();
        return Err(Error::Failed(format!(
            "{dir}: no run of an experiment that comes with hilt is finished; make table3, or hilt experiment NAME, makes them; one of your own is named: hilt report FILE.toml"
        )));
    }
    let sections = shown.iter().map(|finished| section(finished, &context.interrupt)).collect::<Result<Vec<_>>>()?;
    atomic::write_dir(&args.out, is_file, |dir| write(dir, &page(sections, &left_out), &shown))?;
    let runs: usize = shown.iter().map(|finished| finished.runs.len()).sum();
    let of: usize = shown.iter().map(|finished| finished.grid.runs.len()).sum();
    let out = args.out.join("index.html");
    context.console.say(&format!("report: wrote {}: {} experiments, {runs} of {of} runs", out.display(), shown.len()));
    Ok(Outcome::Done)
}

/// All that have a finished run, and why others are left out: one that was changed after it had begun takes no other from the page.
fn all_finished(args: &Args) -> Result<(Vec<Finished>, Vec<String>)> {
    let (mut shown, mut left_out) = (Vec::new(), Vec::new());
    for name in all() {
        match read(args, &name) {
            Ok(finished) if finished.runs.is_empty() => {}
            Ok(finished) => shown.push(finished),
            Err(Error::Interrupted) => return Err(Error::Interrupted),
            Err(why) => left_out.push(format!("`{name}`: {why}")),
        }
    }
    // The paper's tables and figures first, in its order.
    shown.sort_by_key(|finished| {
        let kind = finished.experiment.report;
        (kind == ReportKind::Success, kind as usize)
    });
    Ok((shown, left_out))
}

/// Those of the command line, each of which must have a finished run.
fn named(args: &Args) -> Result<Vec<Finished>> {
    let mut shown: Vec<Finished> = Vec::new();
    for name in &args.names {
        let finished = read(args, name)?;
        let own = finished.experiment.name.clone();
        if shown.iter().any(|other| other.experiment.name == own) {
            return Err(Error::Usage(format!("{own}: is named twice; name each experiment once")));
        }
        if finished.runs.is_empty() {
            let dir = args.runs.join(&own);
            let message = format!("{}: no run of {own} is finished; hilt experiment {name} makes them", dir.display());
            return Err(Error::Failed(message));
        }
        shown.push(finished);
    }
    Ok(shown)
}

fn read(args: &Args, name: &str) -> Result<Finished> {
    let overrides = Overrides { seeds: None, episodes: args.episodes };
    let mut experiment = Experiment::read(&find(name)?, &overrides)?;
    let dir = args.runs.join(&experiment.name);
    let mut grid = Grid::expand(&experiment, &dir)?;
    // Runs of seeds that are not shown belong to the experiment all the same.
    leftovers::check(&dir, &grid)?;
    if let Some(chosen) = &args.seeds {
        experiment.seeds.retain(|seed| chosen.0.contains(seed));
        if experiment.seeds.is_empty() {
            return Err(Error::Usage(format!("--seeds: {} has none of them", experiment.name)));
        }
        grid = Grid::expand(&experiment, &dir)?;
    }
    Finished::read(experiment, grid)
}

fn write(dir: &Path, page: &Page, shown: &[Finished]) -> Result<()> {
    atomic::write_new(&dir.join("index.html"), page.to_html().as_bytes())?;
    atomic::write_new(&dir.join("report.md"), page.to_markdown().as_bytes())?;
    for picture in page.pictures() {
        atomic::write_new(&dir.join("figures").join(format!("{}.svg", picture.id)), picture.to_svg().as_bytes())?;
    }
    for finished in shown {
        for task in finished.tasks() {
            let path = dir.join("tables").join(&finished.experiment.name).join(format!("{task}.parquet"));
            let (table, provenance) = run_table(finished, task);
            atomic::write_new(&path, &table_file::encode(&path, &table, &provenance)?)?;
        }
    }
    Ok(())
}
