//! Messages as lines of JSON, on any input and output: a program's standard ones.

use super::link::{Link, MOST_MESSAGE_BYTES, Message, Received};
use super::paced::TICK;
use super::value::Value;
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use crate::words::shown;
use serde_json::json;
use std::io::{BufRead, Read, Write};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

/// One JSON object a line, in and out.
pub struct LineLink<W> {
    lines: Receiver<Message>,
    out: W,
    gone: bool,
    interrupt: Interrupt,
}

impl<W: Write> LineLink<W> {
    /// Reads `input` on a thread of its own, which ends with it: a read cannot be stopped.
    ///
    /// # Errors
    /// [`Error::Failed`] when there is no thread to be had.
    pub fn new(input: impl BufRead + Send + 'static, out: W, interrupt: &Interrupt) -> Result<Self> {
        // One line is read ahead: who writes faster waits.
        let (sender, lines) = sync_channel(1);
        let read = move || {
            let mut input = input;
            while let Some(message) = read_line(&mut input) {
                if sender.send(message).is_err() {
                    return;
                }
            }
        };
        let started = thread::Builder::new().name("lines".into()).spawn(read);
        started.map_err(|e| Error::Failed(format!("cannot start a thread that reads: {e}")))?;
        Ok(LineLink { lines, out, gone: false, interrupt: interrupt.clone() })
    }

    fn write(&mut self, line: &serde_json::Value) {
        self.gone |= writeln!(self.out, "{line}").and_then(|()| self.out.flush()).is_err();
    }
}

/// The next line that is not empty; `None` at the end. What is too long is passed over.
fn read_line(input: &mut impl BufRead) -> Option<Message> {
    loop {
        let mut line = Vec::new();
        input.by_ref().take(MOST_MESSAGE_BYTES as u64 + 1).read_until(b'\n', &mut line).ok().filter(|count| *count > 0)?;
        if line.len() > MOST_MESSAGE_BYTES {
            pass_over(input, line.ends_with(b"\n"))?;
            return Some(Message::Unreadable(format!("a line of more than {MOST_MESSAGE_BYTES} bytes")));
        }
        if !line.trim_ascii().is_empty() {
            let parsed = serde_json::from_slice(&line);
            return Some(
                parsed
                    .map_or_else(|e| Message::Unreadable(format!("no readable JSON: {}", shown(&e.to_string()))), Message::Json),
            );
        }
    }
}

/// The rest of a line.
fn pass_over(input: &mut impl BufRead, mut ended: bool) -> Option<()> {
    while !ended {
        let part = input.fill_buf().ok().filter(|part| !part.is_empty())?;
        let end = part.iter().position(|b| *b == b'\n');
        let count = end.map_or(part.len(), |at| at + 1);
        ended = end.is_some();
        input.consume(count);
    }
    Some(())
}

impl<W: Write> Link for LineLink<W> {
    fn receive(&mut self, patience: Option<Duration>) -> Result<Received> {
        let began = Instant::now();
        loop {
            self.interrupt.check()?;
            if self.gone {
                return Ok(Received::Gone);
            }
            let left = patience.map_or(TICK, |patience| patience.saturating_sub(began.elapsed()).min(TICK));
            match self.lines.recv_timeout(left) {
                Ok(message) => return Ok(Received::Message(message)),
                Err(RecvTimeoutError::Timeout) if patience.is_some_and(|patience| began.elapsed() >= patience) => {
                    return Ok(Received::Silence);
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => self.gone = true,
            }
        }
    }

    fn send(&mut self, value: &Value) {
        self.write(&value.to_json());
    }

    fn takes_what_it_did_not_ask_for(&self) -> bool {
        true
    }

    fn refuse(&mut self, why: &str) {
        self.write(&json!({ "error": why }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    #[test]
    fn lines_that_are_no_messages_do_not_end_the_conversation() {
        let long = "9".repeat(MOST_MESSAGE_BYTES + 10);
        let input = format!("{{\"a\": 1}}\n\n{{\"a\"\n{long}\n{}\n{{\"b\": [1.5]}}", "[".repeat(5000));
        let mut out = Vec::new();
        let mut link = LineLink::new(Cursor::new(input), &mut out, &Interrupt::default()).expect("a thread");
        let mut came = Vec::new();
        while let Received::Message(message) = link.receive(None).expect("no interrupt") {
            came.push(message.value().map(|value| value.to_json().to_string()));
        }
        link.refuse("no");
        assert_eq!(came.len(), 5);
        assert_eq!((&came[0], &came[4]), (&Ok("{\"a\":1}".into()), &Ok("{\"b\":[1.5]}".into())));
        assert!(came[1..4].iter().all(|line| line.is_err()), "{came:?}");
        assert_eq!(String::from_utf8(out).expect("text"), "{\"error\":\"no\"}\n");
    }
}
