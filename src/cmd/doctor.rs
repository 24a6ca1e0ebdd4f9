use super::places::Places;
use super::{Context, Outcome, output};
use crate::config::ProjectFile;
use crate::data::atomic;
use crate::error::{Error, Result};
use crate::nn::kernel;
use console::Term;
use rustix::fs::statvfs;
use serde::Serialize;
use std::fs;
use std::io::{IsTerminal, stderr};
use std::path::{Path, PathBuf};
use std::thread::available_parallelism;

/// Less free memory than this, and training and simulation of the shipped tasks may be killed \[GB\]: a run of all stages takes some 0.3.
const LEAST_MEMORY_GB: f64 = 1.0;
/// Less free disk than this, and a run of 300 demos with its recordings does not fit \[GB\]: one has some 0.1.
const LEAST_DISK_GB: f64 = 0.5;
const GB: f64 = 1e9;

/// Look at this machine: processor, memory, disk, terminal, and programs that hilt's files may be looked at with. A line each, and what to do.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  hilt doctor\n  hilt doctor --dir /tmp --json")]
pub struct Args {
    /// Directory of the runs
    #[arg(long, value_name = "DIR", default_value = super::common::RUNS)]
    dir: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// How it stands with one thing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
enum State {
    Ok,
    /// Something optional is not there.
    Without,
    Bad,
}

#[derive(Debug, Serialize)]
struct Finding {
    what: &'static str,
    state: State,
    is: String,
    /// What to do, or nothing.
    todo: &'static str,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome> {
    Places::new().check(&context.console)?;
    let findings: Vec<Finding> =
        [processor(), vec![memory()], disk(&args.dir), vec![terminal(), project()], programs()].into_iter().flatten().collect();
    if args.json {
        output::print_json(&findings)?;
    } else {
        output::print(&findings.iter().map(line).collect::<String>())?;
    }
    match findings.iter().filter(|f| f.state == State::Bad).count() {
        0 => Ok(Outcome::Done),
        bad => Err(Error::Failed(format!("{bad} of {} things are bad for hilt here", findings.len()))),
    }
}

/// A line, and one more with what to do.
fn line(Finding { what, state, is, todo }: &Finding) -> String {
    let word = ["ok", "without", "bad"][*state as usize];
    let todo = if todo.is_empty() { String::new() } else { format!("{:19}{todo}\n", "") };
    format!("{word:8} {what:9} {is}\n{todo}")
}

fn finding(what: &'static str, is: impl Into<String>, good: bool, otherwise: (State, &'static str)) -> Finding {
    let (state, todo) = if good { (State::Ok, "") } else { otherwise };
    Finding { what, state, is: is.into(), todo }
}

fn processor() -> Vec<Finding> {
    let cores = available_parallelism().map_or(1, usize::from);
    let chosen = kernel::describe();
    let slow = (State::Bad, "the processor has no FMA: networks take many times as long; use a machine from 2013 or later");
    let fast = !chosen.starts_with("portable");
    vec![
        finding(
            "cores",
            cores.to_string(),
            cores > 1,
            (State::Without, "one core: stages take twice the README's times or more"),
        ),
        finding("kernel", chosen, fast, slow),
    ]
}

fn memory() -> Finding {
    // Only Linux has this file.
    let text = fs::read_to_string("/proc/meminfo").unwrap_or_default();
    let kb = text.lines().find_map(|l| l.strip_prefix("MemAvailable:")?.split_whitespace().next()?.parse::<f64>().ok());
    match kb {
        None => finding("memory", "unknown", false, (State::Without, "this system does not say; a run takes some 0.3 GB")),
        Some(kb) => {
            let gb = kb * 1024.0 / GB;
            finding("memory", format!("{gb:.1} GB free"), gb >= LEAST_MEMORY_GB, (State::Bad, "end other programs"))
        }
    }
}

/// The directory itself, or the nearest above it that is there.
fn disk(dir: &Path) -> Vec<Finding> {
    let there =
        dir.ancestors().find(|above| above.exists()).filter(|above| !above.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let written = atomic::check_place(&dir.join("a file"));
    let why = written.as_ref().err().map_or_else(|| dir.display().to_string(), ToString::to_string);
    let writable = finding("runs", why, written.is_ok(), (State::Bad, "choose another directory: make RUNS=DIR, or --out"));
    let room = match statvfs(there) {
        Err(_) => finding("disk", "unknown", false, (State::Without, "this system does not say")),
        Ok(found) => {
            let gb = found.f_bavail as f64 * found.f_frsize as f64 / GB;
            let todo = "free some, or choose another disk: make RUNS=DIR";
            finding("disk", format!("{gb:.1} GB free at {}", there.display()), gb >= LEAST_DISK_GB, (State::Bad, todo))
        }
    };
    vec![writable, room]
}

fn terminal() -> Finding {
    if !stderr().is_terminal() {
        return finding("terminal", "none: plain lines", true, (State::Ok, ""));
    }
    let (columns, colours) = (Term::stderr().size().1, if console::colors_enabled_stderr() { "colours" } else { "no colours" });
    finding("terminal", format!("{columns} columns, {colours}"), true, (State::Ok, ""))
}

/// The `hilt.toml` that counts here, which may lie in a directory above.
fn project() -> Finding {
    let Some(file) = ProjectFile::here() else { return finding("settings", "no hilt.toml here or above", true, (State::Ok, "")) };
    let read = ProjectFile::read(&file);
    let is = read.as_ref().err().map_or_else(|| file.display().to_string(), ToString::to_string);
    finding("settings", is, read.is_ok(), (State::Bad, "mend the file, or give --config none"))
}

/// What may be of use, any of a few names, and what for.
const PROGRAMS: [(&str, &[&str], &str); 5] = [
    ("make", &["make"], "apt install make: runs the stages one after the other"),
    ("cargo", &["cargo"], "https://rustup.rs: builds hilt from its sources"),
    ("python", &["python3"], "apt install python3: for ONNX and LeRobot, hilt itself needs none"),
    ("browser", &["xdg-open", "open", "firefox", "chromium", "google-chrome"], "reports are HTML pages: open them elsewhere"),
    ("rerun", &["rerun"], "pip install rerun-sdk: shows recordings, see docs/open-elsewhere.md"),
];

fn programs() -> Vec<Finding> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let find = |name: &&str| std::env::split_paths(&path).map(|dir| dir.join(name)).find(|file| file.is_file());
    let of = |(what, names, todo): (&'static str, &[&str], &'static str)| match names.iter().find_map(find) {
        Some(file) => finding(what, file.display().to_string(), true, (State::Ok, "")),
        None => finding(what, "not found", false, (State::Without, todo)),
    };
    PROGRAMS.into_iter().map(of).collect()
}
