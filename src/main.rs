//! The command line: parse, dispatch, turn an outcome into an exit code. The only place that ends the process.

use clap::Parser;
use hilt::cmd::{Cli, Outcome};
use hilt::interrupt::Interrupt;
use std::io::Write;
use std::process::ExitCode;

/// Exit code of a process that Ctrl-C ended: 128 + SIGINT.
const INTERRUPTED: i32 = 130;

fn main() -> ExitCode {
    let cli = Cli::parse();
    let interrupt = Interrupt::default();
    let raised = interrupt.clone();
    let handler = ctrlc::set_handler(move || {
        if raised.is_raised() {
            // The second Ctrl-C does not wait for the loops to notice the first.
            std::process::exit(INTERRUPTED);
        }
        raised.raise();
    });
    if let Err(e) = handler {
        return fail(&format!("cannot listen for Ctrl-C: {e}"), 1);
    }
    match cli.run(interrupt) {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Dropped(_)) => ExitCode::from(Outcome::DROPPED_CODE),
        Err(e) => fail(&e.to_string(), e.exit_code()),
    }
}

fn fail(message: &str, code: u8) -> ExitCode {
    // A closed stderr leaves nobody to tell; the exit code still says it.
    let _ = writeln!(std::io::stderr(), "error: {message}");
    ExitCode::from(code)
}
