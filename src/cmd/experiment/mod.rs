mod child;
mod lock;
mod output;
mod runner;

use super::{Context, Outcome, places::Places};
use crate::error::{Error, Result};
use crate::experiment::state::{State, check_given, states, survey};
use crate::experiment::{Experiment, Grid, Overrides, emit, find, leftovers, seeds_of};
use std::path::{Path, PathBuf};

/// Where experiments go unless a flag says otherwise.
const EXPERIMENTS: &str = "runs/experiments";
/// A step gains little from more threads than these, a machine much from steps side by side.
const THREADS_OF_A_STEP: usize = 2;

/// Run an experiment: a grid of tasks, presets, variations, methods and seeds as ordinary stages, each once. Stopped, the same command goes on.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Name of an experiment in pipelines/experiments, or a file
    #[arg(value_name = "NAME|FILE.toml")]
    name: String,
    /// Directory of its runs and results [default: runs/experiments/NAME]
    #[arg(long, value_name = "DIR")]
    dir: Option<PathBuf>,
    /// Seeds instead of the file's: 0-4,9
    #[arg(long, value_name = "SEEDS", value_parser = parse_seeds)]
    seeds: Option<Chosen>,
    /// Episodes of each evaluation instead of the file's
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    episodes: Option<u64>,
    /// Steps side by side, among which the threads are divided [default: one for each two threads]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    #[command(flatten)]
    instead: Instead,
    /// File for --emit [default: Snakefile, or submit.sh, in the experiment's directory]
    #[arg(long, value_name = "FILE", requires = "emit")]
    out: Option<PathBuf>,
}

/// What is done instead of running.
#[derive(Debug, clap::Args)]
#[group(multiple = false)]
struct Instead {
    /// Print the steps, which are done, and an estimate of time
    #[arg(long)]
    dry_run: bool,
    /// Print the steps for scripts
    #[arg(long, value_name = "FORMAT")]
    list: Option<ListFormat>,
    /// Write the steps as a workflow for another program
    #[arg(long, value_name = "PROGRAM")]
    emit: Option<Program>,
    /// Write the results of what is finished, run nothing
    #[arg(long)]
    collect: bool,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum ListFormat {
    Json,
}

/// Who runs a workflow.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Program {
    Snakemake,
    Slurm,
}

/// Seeds of the command line. Not a bare list: that would be a flag given several times.
#[derive(Clone, Debug)]
struct Chosen(Vec<u64>);

fn parse_seeds(text: &str) -> std::result::Result<Chosen, String> {
    seeds_of(text).map(Chosen)
}

/// An experiment whose file and directory have been checked.
struct Checked<'a> {
    args: &'a Args,
    experiment: Experiment,
    dir: PathBuf,
    grid: Grid,
    jobs: usize,
    /// Threads of a step.
    threads: usize,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    let path = find(&args.name)?;
    let overrides = Overrides { seeds: args.seeds.clone().map(|chosen| chosen.0), episodes: args.episodes };
    let experiment = Experiment::read(&path, &overrides)?;
    let dir = args.dir.clone().unwrap_or_else(|| Path::new(EXPERIMENTS).join(&experiment.name));
    let grid = Grid::expand(&experiment, &dir)?;
    let all = rayon::current_num_threads();
    let jobs = args.jobs.map_or_else(|| all.div_ceil(THREADS_OF_A_STEP), usize::from);
    let checked = Checked { args, experiment, dir, grid, jobs, threads: (all / jobs).max(1) };
    Places::new().read(&path).check(&context.console)?;
    if dir_is_file(&checked.dir) {
        return Err(Error::input(&checked.dir, "is a file; the experiment's directory goes there: choose another --dir"));
    }
    check_given(&checked.grid)?;
    leftovers::check(&checked.dir, &checked.grid)?;
    let runs = !(args.instead.dry_run || args.instead.list.is_some() || args.instead.emit.is_some() || args.instead.collect);
    // Taken before the look at what is done: steps that a killed run has left may still be at work.
    let lock = if runs { Some(lock::Lock::take(&checked.dir, context)?) } else { None };
    let contents = survey(&checked.grid)?;
    let states = states(&checked.grid, &contents);
    match (args.instead.list, args.instead.emit, lock) {
        (Some(ListFormat::Json), ..) => super::output::print_json(&emit::list(&checked.grid, &states, checked.threads))?,
        (_, Some(program), _) => output::emit(&checked, program, context)?,
        (.., Some(lock)) => return runner::run(&checked, contents, lock, context),
        _ if args.instead.dry_run => output::dry_run(&checked, &states)?,
        _ => output::collect(&checked, &contents, context)?,
    }
    Ok(Outcome::Done)
}

fn dir_is_file(dir: &Path) -> bool {
    dir.exists() && !dir.is_dir()
}

impl Checked<'_> {
    /// Runs that are not finished.
    fn unfinished(&self, states: &[State]) -> usize {
        self.grid.runs.iter().filter(|run| states[run.evaluate] != State::Done).count()
    }
}
