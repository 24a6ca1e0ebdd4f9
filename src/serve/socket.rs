//! Messages over a WebSocket.

use super::link::{Link, MOST_MESSAGE_BYTES, Message, Received};
use super::msgpack;
use super::paced::{Paced, is_tick};
use super::seats::Seat;
use super::value::Value;
use crate::error::Result;
use std::time::{Duration, Instant};
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Error as SocketError, Message as Frame, WebSocket};

/// Reading takes this much at once, and memory, a connection.
const BUFFER_BYTES: usize = 16 << 10;

/// What is taken and given over a WebSocket.
pub fn limits() -> WebSocketConfig {
    WebSocketConfig::default()
        .read_buffer_size(BUFFER_BYTES)
        .write_buffer_size(0)
        .max_write_buffer_size(MOST_MESSAGE_BYTES)
        .max_message_size(Some(MOST_MESSAGE_BYTES))
        .max_frame_size(Some(MOST_MESSAGE_BYTES))
}

/// The server's end of a WebSocket.
pub struct SocketLink<'a> {
    socket: WebSocket<Paced>,
    seat: Seat<'a>,
    gone: bool,
}

impl<'a> SocketLink<'a> {
    /// Behind the handshake, with what has come since.
    pub fn new(stream: Paced, came: Vec<u8>, seat: Seat<'a>) -> Self {
        SocketLink { socket: WebSocket::from_partially_read(stream, came, Role::Server, Some(limits())), seat, gone: false }
    }

    fn write(&mut self, frame: Frame) {
        // An answer that is stuck for seconds has no reader.
        self.gone |= self.socket.send(frame).is_err();
    }
}

impl Link for SocketLink<'_> {
    fn receive(&mut self, patience: Option<Duration>) -> Result<Received> {
        let began = Instant::now();
        while !self.gone {
            self.socket.get_ref().check()?;
            let read = self.socket.read();
            if self.seat.is_lost() {
                self.refuse("silent for long, and another has come; connect again");
                self.gone = true;
                break;
            }
            match read {
                Ok(Frame::Binary(bytes)) => {
                    self.socket.get_mut().whole();
                    self.seat.heard();
                    return Ok(Received::Message(Message::Packed(bytes)));
                }
                Ok(Frame::Text(_)) => {
                    self.socket.get_mut().whole();
                    self.seat.heard();
                    let why = "a text frame; messages are binary frames of msgpack";
                    return Ok(Received::Message(Message::Unreadable(why.into())));
                }
                // Pings are answered by the next call; who sends nothing else is silent.
                Ok(_) => self.socket.get_mut().whole(),
                Err(SocketError::Io(e)) if is_tick(&e) => {
                    if patience.is_some_and(|patience| began.elapsed() >= patience) {
                        return Ok(Received::Silence);
                    }
                }
                Err(SocketError::Capacity(e)) => {
                    self.refuse(&format!("{e}; a message has at most {MOST_MESSAGE_BYTES} bytes"));
                    self.gone = true;
                }
                Err(_) => self.gone = true,
            }
        }
        self.socket.get_ref().check()?;
        Ok(Received::Gone)
    }

    fn send(&mut self, value: &Value) {
        self.write(Frame::binary(msgpack::encode(value)));
    }

    fn takes_what_it_did_not_ask_for(&self) -> bool {
        false
    }

    fn refuse(&mut self, why: &str) {
        self.write(Frame::text(why));
    }
}

impl Drop for SocketLink<'_> {
    fn drop(&mut self) {
        // The other end hears that it is over; a broken connection has nobody to tell.
        let _ = self.socket.close(None);
        let _ = self.socket.flush();
    }
}
