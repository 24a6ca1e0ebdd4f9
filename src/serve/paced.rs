//! A connection that answers to the clock and to Ctrl-C, however slow the other end is.

use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// How often a wait looks for an interrupt.
pub const TICK: Duration = Duration::from_millis(50);
/// A message that has begun is whole after this time, or the other end is too slow.
const MOST_MESSAGE_TIME: Duration = Duration::from_secs(10);
/// How long the system may refuse to take an answer.
const MOST_WRITE_TIME: Duration = Duration::from_secs(2);

/// A connection.
#[derive(Debug)]
pub struct Paced {
    stream: TcpStream,
    interrupt: Interrupt,
    /// Since when a message is on its way.
    since: Option<Instant>,
}

impl Paced {
    /// Over `stream`; small messages leave at once.
    ///
    /// # Errors
    /// What the system says.
    pub fn new(stream: TcpStream, interrupt: &Interrupt) -> io::Result<Self> {
        stream.set_nonblocking(false)?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(TICK))?;
        stream.set_write_timeout(Some(MOST_WRITE_TIME))?;
        Ok(Paced { stream, interrupt: interrupt.clone(), since: None })
    }

    /// A message is whole.
    pub fn whole(&mut self) {
        self.since = None;
    }

    /// Stops a wait.
    ///
    /// # Errors
    /// [`Error::Interrupted`].
    pub fn check(&self) -> Result<()> {
        self.interrupt.check()
    }

    /// A dribble of bytes keeps a reader inside of one call: the clock and the interrupt are asked there.
    fn hurry(&self) -> io::Result<()> {
        if self.since.is_some_and(|since| since.elapsed() > MOST_MESSAGE_TIME) {
            return Err(io::Error::new(ErrorKind::ConnectionAborted, "the message takes too long"));
        }
        self.interrupt.check().map_err(|e: Error| io::Error::new(ErrorKind::ConnectionAborted, e.to_string()))
    }
}

/// Whether nothing came for a tick.
pub fn is_tick(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut)
}

impl Read for Paced {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.hurry()?;
        // A signal ends a wait before its flag is up: one tick more, and it is.
        let early = |e: io::Error| if e.kind() == ErrorKind::Interrupted { ErrorKind::WouldBlock.into() } else { e };
        let count = self.stream.read(buffer).map_err(early)?;
        self.since.get_or_insert_with(Instant::now);
        Ok(count)
    }
}

impl Write for Paced {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        loop {
            self.interrupt.check().map_err(|e: Error| io::Error::new(ErrorKind::ConnectionAborted, e.to_string()))?;
            match self.stream.write(buffer) {
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                written => return written,
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}
