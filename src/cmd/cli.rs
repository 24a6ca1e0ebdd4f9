//! The command line as a whole: parse and dispatch.

use super::console::Console;
use super::context::{Context, Outcome};
use super::{
    compare, completions, convert, dataset, doctor, evaluate, experiment, export, inspect, man, plan, plot, pretrain, render,
    replay, report, robot, runs, serve, serve_env, settings, simulate, train, view,
};
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use clap::{CommandFactory, Parser, Subcommand};
use rustix::time::{ClockId, clock_gettime};
use std::path::PathBuf;
use std::time::Instant;

/// Hybrid imitation learning for robot manipulation: from a task's name to an evaluated policy.
///
/// The stages in order: plan, simulate, convert, pretrain, train, evaluate. Each reads files and writes files, by default under
/// runs/TASK/. `make all TASK=stack` runs them all.
#[derive(Debug, Parser)]
#[command(
    name = "hilt",
    version,
    max_term_width = 100,
    after_help = "Exit codes: 0 done, 1 failed, 2 wrong usage, 3 done but episodes were dropped, 130 interrupted (143 by SIGTERM, 129 by SIGHUP).\n\
                  Results go to stdout, words and progress to stderr."
)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Worker threads; results do not depend on it [default: one per processor]
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Write words and wall times to this file too; its name ends in .log
    #[arg(long, global = true, value_name = "FILE")]
    log: Option<PathBuf>,
    /// Print errors only
    #[arg(long, short, global = true)]
    quiet: bool,
    /// Exit with 0 instead of 3 when episodes were dropped; they are counted and named all the same
    #[arg(long, global = true)]
    allow_dropped: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    Plan(plan::Args),
    Simulate(simulate::Args),
    Convert(convert::Args),
    Pretrain(pretrain::Args),
    Train(train::Args),
    Evaluate(evaluate::Args),
    Inspect(inspect::Args),
    Runs(runs::Args),
    Compare(compare::Args),
    Plot(plot::Args),
    Dataset(dataset::Args),
    View(view::Args),
    Render(render::Args),
    Replay(replay::Args),
    Settings(settings::Args),
    Experiment(experiment::Args),
    Report(report::Args),
    Robot(robot::Args),
    Export(export::Args),
    Serve(serve::Args),
    ServeEnv(serve_env::Args),
    Doctor(doctor::Args),
    Completions(completions::Args),
    Man(man::Args),
}

impl Cli {
    /// Runs the chosen stage.
    ///
    /// # Errors
    /// What the stage returns; [`Error::Failed`] when no worker threads can be started.
    pub fn run(&self, interrupt: Interrupt) -> Result<Outcome> {
        let threads = self.threads.map_or(0, usize::from); // 0 leaves the choice to rayon: one per processor
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build_global()
            .map_err(|e| Error::Failed(format!("cannot start worker threads: {e}; try --threads 1")))?;
        let goes_on = matches!(&self.command, Command::Train(args) if args.resume);
        let context = Context { console: Console::new(self.quiet, self.log.as_deref(), goes_on), interrupt };
        let outcome = self.dispatch(&context);
        if let Err(why) = &outcome {
            context.console.log_error(why);
        }
        outcome
    }

    /// Runs the command; one that works, and does not only answer, says how long it took.
    fn dispatch(&self, context: &Context) -> Result<Outcome> {
        let started = Instant::now();
        let outcome = match &self.command {
            Command::Plan(args) => plan::run(args, context),
            Command::Simulate(args) => simulate::run(args, context),
            Command::Convert(args) => convert::run(args, context),
            Command::Pretrain(args) => pretrain::run(args, context),
            Command::Train(args) => train::run(args, context),
            Command::Evaluate(args) => evaluate::run(args, context),
            Command::Experiment(args) => experiment::run(args, context),
            Command::Report(args) => report::run(args, context),
            Command::Export(args) if export::only_answers(args) => return export::run(args, context),
            Command::Export(args) => export::run(args, context),
            Command::Dataset(args) if dataset::only_answers(args) => return dataset::run(args, context),
            Command::Dataset(args) => dataset::run(args, context),
            Command::Serve(args) => serve::run(args, context),
            Command::ServeEnv(args) => serve_env::run(args, context),
            Command::Inspect(args) => return inspect::run(args, context),
            Command::Runs(args) => return runs::run(args, context),
            Command::Compare(args) => return compare::run(args, context),
            Command::Plot(args) => return plot::run(args, context),
            Command::View(args) => view::run(args, context),
            Command::Render(args) => render::run(args, context),
            Command::Replay(args) => replay::run(args, context),
            Command::Robot(args) => return robot::run(args, context),
            Command::Settings(args) => return settings::run(args, context),
            Command::Doctor(args) => return doctor::run(args, context),
            Command::Completions(args) => return completions::run(args, Cli::command(), context),
            Command::Man(args) => return man::run(args, Cli::command(), context),
        };
        if outcome.is_ok() {
            context.console.say(&format!("processor time {:.1} s", processor_s()));
            context.console.say(&format!("wall time {:.1} s", started.elapsed().as_secs_f64()));
        }
        match outcome {
            Ok(Outcome::Dropped(_)) if self.allow_dropped => Ok(Outcome::Done),
            other => other,
        }
    }
}

/// What all threads of the process have taken so far \[s\].
fn processor_s() -> f64 {
    let taken = clock_gettime(ClockId::ProcessCPUTime);
    taken.tv_sec as f64 + taken.tv_nsec as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        super::Cli::command().debug_assert();
    }
}
