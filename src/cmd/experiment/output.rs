//! What is printed and written beside the runs: plans of work, results, workflows.

use super::args::Program;
use super::checked::Checked;
use super::child;
use crate::cmd::{Context, output};
use crate::data::atomic;
use crate::error::{Error, Result};
use crate::experiment::emit::{self, Site};
use crate::experiment::estimate::{Estimate, in_words};
use crate::experiment::results::{self, RESULTS, Row, TIMES};
use crate::experiment::state::{Contents, State, states};
use crate::report::table::text_table;
use std::fs;
use std::io::Read;
use std::path::Path;

/// What tells an emitted file is within so many bytes.
const HEAD_BYTES: u64 = 512;

/// The steps, how they stand and how long they will take.
pub fn dry_run(checked: &Checked, states: &[State]) -> Result<()> {
    let (grid, jobs, threads) = (&checked.grid, checked.jobs, checked.threads);
    let estimate = Estimate::of(grid, states, threads);
    let row = |(step, state): (&crate::experiment::Step, &State)| {
        let (seconds, measured) = estimate.of_step(step);
        let (time, by) = match state {
            State::Done => (String::new(), ""),
            _ => (format!("{seconds:.1} s"), if measured { "finished steps" } else { "stated rates" }),
        };
        vec![step.id.clone(), state.name().into(), time, by.into()]
    };
    let rows: Vec<Vec<String>> = grid.steps.iter().zip(states).map(row).collect();
    let left = states.iter().filter(|state| **state != State::Done).count();
    let (seconds, measured) = estimate.of_all(grid, states, jobs);
    let (all, runs, unfinished) = (grid.steps.len(), grid.runs.len(), checked.unfinished(states));
    output::print(&format!(
        "{}{runs} runs, {unfinished} not finished; {left} of {all} steps to do, about {} with --jobs {jobs} of {threads} threads: {measured} steps by finished \
         ones of their stage and task, {} by rates of a machine with 2 cores\n",
        text_table(&["step", "state", "time", "by"], &rows),
        in_words(seconds),
        left - measured
    ))
}

/// Writes the results of what is finished and prints them.
///
/// # Errors
/// [`Error::Failed`] when runs are missing; what reading and writing return.
pub fn collect(checked: &Checked, contents: &Contents, context: &Context) -> Result<()> {
    let rows = write(checked, contents)?;
    let row = |row: &Row| {
        let Row { run, summary, .. } = row;
        let [low, high] = summary.wilson_95.map(|v| 100.0 * v);
        let name = [&run.task, &run.preset, &run.variation, run.method.name()].map(String::from);
        let counts =
            [run.seed.to_string(), format!("{} of {}", summary.successes, summary.episodes), format!("{low:.1} to {high:.1} %")];
        name.into_iter().chain(counts).collect()
    };
    let table: Vec<Vec<String>> = rows.iter().map(row).collect();
    output::print(&text_table(&["task", "preset", "variation", "method", "seed", "success", "95 % interval"], &table))?;
    context.console.say(&format!("experiment: wrote {}", checked.dir.join(RESULTS).display()));
    let missing = checked.unfinished(&states(&checked.grid, contents));
    if missing == 0 {
        return Ok(());
    }
    let (runs, name) = (checked.grid.runs.len(), &checked.args.name);
    Err(Error::Failed(format!("{missing} of {runs} runs are not finished; hilt experiment {name} goes on with them")))
}

/// Refuses, before any work, files of somebody's own where the tables of results and of wall times go.
///
/// # Errors
/// [`Error::Input`] names the file.
pub fn check_tables(dir: &Path) -> Result<()> {
    refuse_foreign(&dir.join(RESULTS), "task,preset,variation,")?;
    refuse_foreign(&dir.join(TIMES), "step,stage,task,")
}

/// Writes the tables of results and of wall times.
pub fn write<'a>(checked: &'a Checked, contents: &Contents) -> Result<Vec<Row<'a>>> {
    check_tables(&checked.dir)?;
    let (results, times) = (checked.dir.join(RESULTS), checked.dir.join(TIMES));
    let rows = results::rows(&checked.grid, contents)?;
    let (table, wall) = (results::to_csv(&rows, &checked.grid), results::times_csv(&checked.grid, contents));
    atomic::write_all(&[(times, wall.into_bytes()), (results, table.into_bytes())])?;
    Ok(rows)
}

/// Writes the workflow for another program.
pub fn emit(checked: &Checked, program: Program, context: &Context) -> Result<()> {
    let name = match program {
        Program::Snakemake => "Snakefile",
        Program::Slurm => "submit.sh",
    };
    let out = checked.args.out.clone().unwrap_or_else(|| checked.dir.join(name));
    refuse_foreign(&out, emit::MARK)?;
    let binary = child::own_binary()?;
    let hilt = binary.display().to_string();
    let collect = collecting(checked);
    let site =
        Site { hilt: &hilt, name: &checked.experiment.name, dir: &checked.dir, collect: &collect, threads: checked.threads };
    let text = match program {
        Program::Snakemake => emit::snakemake(&checked.grid, &site),
        Program::Slurm => emit::slurm(&checked.grid, &site),
    };
    atomic::write_bytes(&out, text.as_bytes())?;
    let steps = checked.grid.steps.len();
    context.console.say(&format!("experiment: wrote {} with {steps} steps", out.display()));
    Ok(())
}

/// The arguments that collect the results of the same grid.
fn collecting(checked: &Checked) -> Vec<String> {
    let mut words = ["experiment", &checked.args.name, "--dir", &checked.dir.display().to_string()].map(String::from).to_vec();
    if let Some(chosen) = &checked.args.seeds {
        let seeds: Vec<String> = chosen.0.iter().map(u64::to_string).collect();
        words.extend(["--seeds".into(), seeds.join(",")]);
    }
    if let Some(episodes) = checked.args.episodes {
        words.extend(["--episodes".into(), episodes.to_string()]);
    }
    words.push("--collect".into());
    words
}

/// A file that hilt has not made is not replaced.
fn refuse_foreign(path: &Path, mark: &str) -> Result<()> {
    if !path.is_file() {
        return Ok(());
    }
    let mut head = Vec::new();
    let read = fs::File::open(path).and_then(|file| file.take(HEAD_BYTES).read_to_end(&mut head));
    read.map_err(|e| Error::io(path, "read", e))?;
    if head.is_empty() || String::from_utf8_lossy(&head).contains(mark) {
        return Ok(());
    }
    Err(Error::input(path, "was not made by hilt experiment, and would be lost; move it away or choose another place"))
}
