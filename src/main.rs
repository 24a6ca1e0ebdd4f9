//! The command line: parse, dispatch, turn an outcome into an exit code. The only place that ends the process.

use clap::Parser;
use hilt::cmd::{Cli, Outcome};
use hilt::interrupt::Interrupt;
use signal_hook::consts::{SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::flag;
use std::io::Write;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Exit code of a process that Ctrl-C ended: 128 + SIGINT.
const INTERRUPTED: i32 = 130;

/// Ctrl-C, and what `kill`, `timeout` and batch systems send. A hang-up keeps its meaning, so that `nohup` works.
const INTERRUPTS: [i32; 2] = [SIGINT, SIGTERM];

fn main() -> ExitCode {
    let cli = Cli::parse();
    if let Err(e) = hilt::nn::kernel::choose() {
        return fail(&e.to_string(), e.exit_code());
    }
    let interrupt = Interrupt::default();
    if let Err(e) = listen(&interrupt) {
        return fail(&format!("cannot listen for signals: {e}"), 1);
    }
    match cli.run(interrupt) {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Dropped(_)) => ExitCode::from(Outcome::DROPPED_CODE),
        Err(e) => fail(&e.to_string(), e.exit_code()),
    }
}

/// The first signal asks the loops to stop, the second does not wait for them. A file-size limit is an error of `write`, not the
/// process's end.
fn listen(interrupt: &Interrupt) -> std::io::Result<()> {
    for signal in INTERRUPTS {
        // In this order: the first signal finds the flag down.
        flag::register_conditional_shutdown(signal, INTERRUPTED, interrupt.flag())?;
        flag::register(signal, interrupt.flag())?;
    }
    flag::register(SIGXFSZ, Arc::<AtomicBool>::default())?;
    Ok(())
}

fn fail(message: &str, code: u8) -> ExitCode {
    // A closed stderr leaves nobody to tell; the exit code still says it.
    let _ = writeln!(std::io::stderr(), "error: {message}");
    ExitCode::from(code)
}
