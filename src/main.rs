//! The command line: parse, dispatch, turn an outcome into an exit code. The only place that ends the process.

use clap::Parser;
use clap::error::ErrorKind;
use console::style;
use hilt::cmd::{Cli, Outcome};
use hilt::interrupt::{Interrupt, anyone_waits};
use hilt::nn::kernel;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::flag;
use signal_hook::iterator::Signals;
use std::io::Write;
use std::process::{ExitCode, exit};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::thread;
use std::time::{Duration, Instant};

/// Exit code of a process that a signal ended: 128 + its number.
const SIGNALLED: i32 = 128;

/// Ctrl-C, and what `kill`, `timeout` and batch systems send; and a terminal that is gone, unless `nohup` has it ignored.
const INTERRUPTS: [i32; 2] = [SIGINT, SIGTERM];

/// Where Linux says which signals are ignored, a bit each, in hexadecimal digits.
const STATUS: &str = "/proc/self/status";
const IGNORED: &str = "SigIgn:";

/// A second signal counts only after this time: a signal to the whole process group, which `make` passes on once more, arrives twice.
const SAME_SIGNAL: Duration = Duration::from_secs(1);

/// After a signal, how long a thread may wait for an input (a pipe, a stalled file system) before the process ends without it.
const PATIENCE: Duration = Duration::from_millis(500);

/// How often is looked after a first signal.
const TICK: Duration = Duration::from_millis(20);

fn main() -> ExitCode {
    if let Err(e) = kernel::choose() {
        return fail(&e.to_string(), e.exit_code(None));
    }
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(e) if e.kind() == ErrorKind::DisplayVersion => {
            // Who closed stdout does not want to know.
            let commit = option_env!("HILT_COMMIT").unwrap_or("unknown: not built from its repository");
            let _ = writeln!(std::io::stdout(), "{e}commit: {commit}\nkernel: {}", kernel::describe());
            return ExitCode::SUCCESS;
        }
        Err(e) => e.exit(),
    };
    let interrupt = Interrupt::default();
    if let Err(e) = listen(interrupt.clone()) {
        return fail(&format!("cannot listen for signals: {e}"), 1);
    }
    match cli.run(interrupt.clone()) {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Dropped(_)) => ExitCode::from(Outcome::DROPPED_CODE),
        Err(e) => fail(&e.to_string(), e.exit_code(interrupt.signal())),
    }
}

/// The first signal asks the loops to stop, a later one does not wait for them. A file-size limit is an error of `write`, not the
/// process's end.
fn listen(interrupt: Interrupt) -> std::io::Result<()> {
    flag::register(SIGXFSZ, Arc::<AtomicBool>::default())?;
    let signals = Signals::new(INTERRUPTS.into_iter().chain((!ignored(SIGHUP)).then_some(SIGHUP)))?;
    thread::Builder::new().name("signals".into()).spawn(move || watch(signals, &interrupt)).map(drop)
}

/// Whether this signal was ignored when the process began; where that cannot be known it counts as ignored.
fn ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string(STATUS).unwrap_or_default();
    let digits = status.lines().find_map(|line| line.strip_prefix(IGNORED));
    let set = digits.and_then(|digits| u64::from_str_radix(digits.trim(), 16).ok());
    set.is_none_or(|set| set >> (signal - 1) & 1 == 1)
}

fn watch(mut signals: Signals, interrupt: &Interrupt) {
    let Some(first) = signals.forever().next() else { return };
    let (since, mut idle_since) = (Instant::now(), Instant::now());
    interrupt.raise(first);
    loop {
        thread::sleep(TICK);
        if let Some(again) = signals.pending().last().filter(|_| since.elapsed() > SAME_SIGNAL) {
            exit(SIGNALLED + again);
        }
        if !anyone_waits() {
            idle_since = Instant::now();
        }
        if idle_since.elapsed() > PATIENCE {
            fail("interrupted while it waited for an input; no artefact was changed", 0);
            exit(SIGNALLED + first);
        }
    }
}

fn fail(message: &str, code: u8) -> ExitCode {
    // A closed stderr leaves nobody to tell; the exit code still says it.
    let _ = writeln!(std::io::stderr(), "{} {message}", style("error:").for_stderr().red().bold());
    ExitCode::from(code)
}
