//! The flags of commands that others talk to.

use super::{Context, Outcome, output};
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use crate::serve::{Host, LineLink, Server, Token, check_address, read_token};
use std::io::{BufReader, Read, stdin, stdout};
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

/// The signal that asks a process to end.
const SIGTERM: i32 = 15;

/// Where and to whom.
#[derive(Debug, clap::Args)]
pub struct ListenArgs {
    /// Address to listen on; other than of this machine alone (0.0.0.0) with --token-file
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1")]
    host: IpAddr,
    /// Port; 0 takes a free one. The address, ws://HOST:PORT, is the one line on stdout
    #[arg(long, value_name = "N", default_value_t = 8000)]
    port: u16,
    /// File with the secret that clients must send (Authorization: Bearer SECRET); at least 16 characters
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,
    /// Clients at the same time; others are turned away
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u16).range(1..=1024))]
    connections: u16,
    /// End when standard input ends: with the program that has started this one
    #[arg(long)]
    end_with_stdin: bool,
    /// Speak JSON over standard input and output, one object a line, instead of listening
    #[arg(long, conflicts_with_all = ["host", "port", "token_file", "connections", "end_with_stdin"])]
    stdio: bool,
}

impl ListenArgs {
    /// Files that are read.
    pub fn reads(&self) -> Option<&Path> {
        self.token_file.as_deref()
    }

    /// Serves until it is interrupted, or its input ends.
    ///
    /// # Errors
    /// [`Error::Usage`] for an address that would be open to all; what [`Server`] returns.
    pub fn serve(&self, host: &dyn Host, context: &Context) -> Result<Outcome> {
        if self.stdio {
            let mut link = LineLink::new(BufReader::new(stdin()), stdout(), &context.interrupt)?;
            return host.converse(&mut link, 0).map(|()| Outcome::Done);
        }
        let token = self.token_file.as_deref().map(read_token).transpose()?.map(|text| Token::new(&text));
        check_address(self.host, token.as_ref())?;
        let server = Server::bind(self.host, self.port, token, self.connections.into())?;
        let ended = Arc::<AtomicBool>::default();
        if self.end_with_stdin {
            end_with_stdin(&context.interrupt, &ended)?;
        }
        output::print(&format!("ws://{}\n", server.address()?))?;
        match server.run(host, &context.interrupt, &|line| context.console.say(line)) {
            Err(Error::Interrupted) if ended.load(Ordering::SeqCst) => Ok(Outcome::Done),
            other => other.map(|()| Outcome::Done),
        }
    }
}

/// Stops the server when there is nothing more to read, and says so in `ended`.
fn end_with_stdin(interrupt: &Interrupt, ended: &Arc<AtomicBool>) -> Result<()> {
    let (interrupt, ended) = (interrupt.clone(), Arc::clone(ended));
    let wait = move || {
        let mut part = [0; 1024];
        // Whatever comes is passed over; an error is an end as well.
        while stdin().read(&mut part).is_ok_and(|count| count > 0) {}
        ended.store(true, Ordering::SeqCst);
        interrupt.raise(SIGTERM);
    };
    let started = thread::Builder::new().name("stdin".into()).spawn(wait);
    started.map(drop).map_err(|e| Error::Failed(format!("cannot start a thread that waits: {e}")))
}
