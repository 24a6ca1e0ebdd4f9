//! Listens, and holds a conversation on a thread of its own with each who may.

use super::access::Token;
use super::handshake::{shake, turn_away};
use super::link::Link;
use super::paced::{Paced, TICK};
use super::seats::{PATIENCE, Seats};
use super::socket::SocketLink;
use crate::error::{Error, Result};
use crate::guard::guarded;
use crate::interrupt::Interrupt;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::io::ErrorKind;
use std::net::{IpAddr, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

/// Callers at the same time who have not yet said who they are: more than come at once, less than a machine has threads.
const MOST_CALLERS: usize = 64;

/// Where is listened, and to whom.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    token: Option<Token>,
    /// Conversations at the same time.
    most: usize,
    /// Who has been silent for so long gives way to others.
    patience: Duration,
}

/// What is said and answered in one conversation; it ends when the link is gone.
pub trait Host: Sync {
    /// Holds conversation number `number`, over any link.
    ///
    /// # Errors
    /// [`Error::Interrupted`].
    fn converse(&self, link: &mut dyn Link, number: u64) -> Result<()>;
}

impl Server {
    /// Takes the port; 0 takes a free one.
    ///
    /// # Errors
    /// [`Error::Failed`] when it is not to be had.
    pub fn bind(host: IpAddr, port: u16, token: Option<Token>, most: usize) -> Result<Self> {
        let address = SocketAddr::new(host, port);
        let refused = |e: std::io::Error| {
            let advice = match e.kind() {
                ErrorKind::AddrInUse => ": another program listens there; give another --port, or --port 0 for a free one",
                ErrorKind::AddrNotAvailable => ": this machine has no such address; give another --host",
                ErrorKind::PermissionDenied => ": give a --port above 1023",
                _ => "",
            };
            Error::Failed(format!("cannot listen on {address}: {e}{advice}"))
        };
        let listener = TcpListener::bind(address).map_err(refused)?;
        listener.set_nonblocking(true).map_err(refused)?;
        Ok(Server { listener, token, most, patience: PATIENCE })
    }

    /// The same with another patience with who is silent where all places are taken.
    pub fn with_patience(self, patience: Duration) -> Self {
        Server { patience, ..self }
    }

    /// Where it listens.
    ///
    /// # Errors
    /// [`Error::Failed`] when the system does not say.
    pub fn address(&self) -> Result<SocketAddr> {
        self.listener.local_addr().map_err(|e| Error::Failed(format!("cannot tell where it listens: {e}")))
    }

    /// Serves until it is interrupted; `say` hears words about who comes and goes.
    ///
    /// # Errors
    /// [`Error::Interrupted`], when all conversations have ended.
    pub fn run(&self, host: &dyn Host, interrupt: &Interrupt, say: &(dyn Fn(&str) + Sync)) -> Result<()> {
        let (callers, seats) = (AtomicUsize::new(0), Seats::new(self.most, self.patience));
        thread::scope(|scope| {
            for number in 0.. {
                let (mut stream, peer) = self.next(interrupt)?;
                let caller = Caller::new(&callers);
                if callers.load(Ordering::SeqCst) > MOST_CALLERS {
                    turn_away(&mut stream, "too many call at once; try again later");
                    continue;
                }
                let seats = &seats;
                let work = move || {
                    let Ok(mut stream) = Paced::new(stream, interrupt) else { return };
                    let Some((came, seat)) = shake(&mut stream, self.token.as_ref(), || seats.take()) else { return };
                    drop(caller);
                    match host.converse(&mut SocketLink::new(stream, came, seat), number) {
                        Ok(()) | Err(Error::Interrupted) => {}
                        Err(why) => say(&format!("{peer}: {why}")),
                    }
                };
                let started = thread::Builder::new().name(format!("client {number}")).spawn_scoped(scope, move || {
                    // One that breaks down is the end of one conversation.
                    if let Err(why) = guarded(work) {
                        say(&format!("{peer}: the conversation broke down: {why}"));
                    }
                });
                if let Err(e) = started {
                    say(&format!("{peer}: turned away, no thread is to be had: {e}"));
                }
            }
            Ok(())
        })
    }

    /// The next who calls.
    fn next(&self, interrupt: &Interrupt) -> Result<(TcpStream, SocketAddr)> {
        let tick = Timespec { tv_sec: 0, tv_nsec: i64::from(TICK.subsec_nanos()) };
        loop {
            interrupt.check()?;
            match self.listener.accept() {
                Ok(caller) => return Ok(caller),
                Err(e) if e.kind() == ErrorKind::WouldBlock => {
                    // Whatever ends the wait, the listener is asked again.
                    let _ = poll(&mut [PollFd::new(&self.listener, PollFlags::IN)], Some(&tick));
                }
                // Gone again, or no file descriptor is left for now.
                Err(_) => thread::sleep(TICK),
            }
        }
    }
}

/// One who has called and not yet been let in; counted as long as the value lives.
struct Caller<'a>(&'a AtomicUsize);

impl<'a> Caller<'a> {
    fn new(count: &'a AtomicUsize) -> Self {
        count.fetch_add(1, Ordering::SeqCst);
        Caller(count)
    }
}

impl Drop for Caller<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::SeqCst);
    }
}
