//! A conversation with a server that somebody else runs: questions, each with its answer.

use super::link::MOST_MESSAGE_BYTES;
use super::msgpack;
use super::paced::{Paced, is_tick};
use super::socket::limits;
use super::value::Value;
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use crate::words::shown;
use std::net::{TcpStream, ToSocketAddrs};
use std::thread;
use std::time::{Duration, Instant};
use tungstenite::client::{ClientRequestBuilder, client_with_config};
use tungstenite::http::{StatusCode, Uri};
use tungstenite::{Bytes, Error as SocketError, HandshakeError, Message as Frame, WebSocket};

/// Until a connection stands.
const CONNECT_TIME: Duration = Duration::from_secs(5);
/// Until an answer is there: a server that serves one after the other lets the others wait, a large network takes its time.
const ANSWER_TIME: Duration = Duration::from_secs(60);
/// Between two tries at a server that is full.
const RETRY_TIME: Duration = Duration::from_millis(50);
/// Port of an address without one.
const PORT: u16 = 80;

/// Where a server is, and what it must be told.
#[derive(Clone, Debug)]
pub struct Address {
    uri: Uri,
    host: String,
    port: u16,
    token: Option<String>,
}

impl Address {
    /// Of `ws://HOST:PORT`.
    ///
    /// # Errors
    /// [`Error::Usage`] says how one is written.
    pub fn new(url: &str, token: Option<String>) -> Result<Self> {
        let wrong = |why: &str| Error::Usage(format!("{}: {why}; it is written ws://HOST:PORT", shown(url)));
        let uri: Uri = url.parse().map_err(|e| wrong(&format!("no address ({e})")))?;
        match uri.scheme_str() {
            Some("ws") => {}
            Some("wss") => {
                return Err(wrong("hilt speaks no TLS; go through a tunnel (ssh -L), which keeps the token secret too"));
            }
            _ => return Err(wrong("no WebSocket's address")),
        }
        let host = uri.host().filter(|host| !host.is_empty()).ok_or_else(|| wrong("no host"))?;
        let host = host.trim_start_matches('[').trim_end_matches(']').to_string();
        Ok(Address { port: uri.port_u16().unwrap_or(PORT), host, uri, token })
    }

    /// An error of this server.
    pub(super) fn failed(&self, why: &str) -> Error {
        Error::Failed(format!("{}: {why}", self.uri))
    }
}

/// An open conversation.
pub struct Dial {
    socket: WebSocket<Paced>,
    address: Address,
}

impl Dial {
    /// Connects; a server whose connections are all taken is asked again for a while.
    ///
    /// # Errors
    /// [`Error::Failed`] says who does not answer, or how; [`Error::Interrupted`].
    pub fn connect(address: &Address, interrupt: &Interrupt) -> Result<Self> {
        let began = Instant::now();
        loop {
            interrupt.check()?;
            match Self::shake(address, interrupt) {
                Err(SocketError::Http(response))
                    if response.status() == StatusCode::SERVICE_UNAVAILABLE && began.elapsed() < ANSWER_TIME =>
                {
                    thread::sleep(RETRY_TIME);
                }
                Err(why) => {
                    interrupt.check()?;
                    return Err(address.failed(&refusal(&why)));
                }
                Ok(mut socket) => {
                    socket.get_mut().whole();
                    return Ok(Dial { socket, address: address.clone() });
                }
            }
        }
    }

    fn shake(address: &Address, interrupt: &Interrupt) -> std::result::Result<WebSocket<Paced>, SocketError> {
        let stream = reach(address)?;
        let mut request = ClientRequestBuilder::new(address.uri.clone());
        if let Some(token) = &address.token {
            request = request.with_header("Authorization", format!("Bearer {token}"));
        }
        let began = Instant::now();
        let mut step = client_with_config(request, Paced::new(stream, interrupt)?, Some(limits()));
        loop {
            match step {
                Ok((socket, _)) => return Ok(socket),
                Err(HandshakeError::Failure(why)) => return Err(why),
                Err(HandshakeError::Interrupted(_)) if began.elapsed() > ANSWER_TIME => {
                    return Err(std::io::Error::new(std::io::ErrorKind::TimedOut, "no answer to the handshake").into());
                }
                Err(HandshakeError::Interrupted(half)) => {
                    half.get_ref().get_ref().check().map_err(|_| SocketError::ConnectionClosed)?;
                    step = half.handshake();
                }
            }
        }
    }

    /// Sends a value.
    ///
    /// # Errors
    /// [`Error::Failed`] when the server does not take it; [`Error::Interrupted`].
    pub fn send(&mut self, value: &Value) -> Result<()> {
        self.socket.get_ref().check()?;
        let sent = self.socket.send(Frame::binary(msgpack::encode(value)));
        sent.map_err(|why| self.address.failed(&format!("takes no more: {why}")))
    }

    /// Waits for the next message.
    ///
    /// # Errors
    /// [`Error::Failed`] when it does not come, or refuses; [`Error::Interrupted`].
    pub fn receive(&mut self) -> Result<Bytes> {
        let began = Instant::now();
        loop {
            self.socket.get_ref().check()?;
            let read = self.socket.read();
            match read {
                Ok(Frame::Binary(bytes)) => {
                    self.socket.get_mut().whole();
                    return Ok(bytes);
                }
                Ok(Frame::Text(why)) => return Err(self.address.failed(&format!("refuses: {}", last_lines(&why)))),
                Ok(_) => self.socket.get_mut().whole(),
                Err(SocketError::Io(e)) if is_tick(&e) => {
                    if began.elapsed() > ANSWER_TIME {
                        let seconds = ANSWER_TIME.as_secs();
                        return Err(self.address.failed(&format!("has not answered for {seconds} s")));
                    }
                }
                Err(SocketError::Capacity(_)) => {
                    return Err(self.address.failed(&format!("answers with more than {MOST_MESSAGE_BYTES} bytes")));
                }
                Err(why) => {
                    self.socket.get_ref().check()?;
                    return Err(self.address.failed(&format!("has ended the conversation: {why}")));
                }
            }
        }
    }
}

impl Drop for Dial {
    fn drop(&mut self) {
        // The server hears that it is over; a broken connection has nobody to tell.
        let _ = self.socket.close(None);
        let _ = self.socket.flush();
    }
}

fn reach(address: &Address) -> std::io::Result<TcpStream> {
    let mut last = std::io::Error::new(std::io::ErrorKind::NotFound, "the host has no address");
    for place in (address.host.as_str(), address.port).to_socket_addrs()? {
        match TcpStream::connect_timeout(&place, CONNECT_TIME) {
            Ok(stream) => return Ok(stream),
            Err(why) => last = why,
        }
    }
    Err(last)
}

fn refusal(why: &SocketError) -> String {
    match why {
        SocketError::Io(e) => format!("nobody answers: {e}; is the server running, and is this its address?"),
        SocketError::Http(response) => match response.status() {
            StatusCode::UNAUTHORIZED => "wants another token; give --token-file FILE with the server's".into(),
            status => format!("refuses the connection: {status}"),
        },
        other => format!("is no WebSocket server: {other}"),
    }
}

/// A Python server sends its whole traceback; its end says what was wrong.
fn last_lines(why: &str) -> String {
    let lines: Vec<&str> = why.trim().lines().collect();
    shown(&lines[lines.len().saturating_sub(2)..].join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_those_of_sockets() {
        let found = |url: &str| Address::new(url, None).map(|a| (a.host, a.port)).map_err(|e| e.to_string());
        assert_eq!(found("ws://localhost:8000"), Ok(("localhost".into(), 8000)));
        assert_eq!(found("ws://[::1]:9/policy"), Ok(("::1".into(), 9)));
        assert_eq!(found("ws://robot"), Ok(("robot".into(), 80)));
        assert!(found("wss://robot:1").is_err_and(|why| why.contains("no TLS")));
        for url in ["http://localhost:8000", "localhost:8000", "ws://", "ws://:8000", "ws://a b", ""] {
            assert!(found(url).is_err_and(|why| why.contains("ws://HOST:PORT")), "{url}");
        }
    }
}
