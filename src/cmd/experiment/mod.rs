mod args;
mod checked;
mod child;
mod lock;
mod output;
mod runner;

pub use args::{Args, Chosen, parse_seeds};

use super::{Context, Outcome, places::Places};
use crate::error::{Error, Result};
use crate::experiment::state::{check_given, states, survey};
use crate::experiment::{Experiment, Grid, Overrides, emit, find, leftovers};
use args::ListFormat;
use checked::Checked;
use std::path::Path;

/// Where experiments go unless a flag says otherwise.
pub const EXPERIMENTS: &str = "runs/experiments";
/// A step gains little from more threads than these, a machine much from steps side by side.
const THREADS_OF_A_STEP: usize = 2;

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
    if runs {
        output::check_tables(&checked.dir)?;
    }
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
