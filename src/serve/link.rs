//! A conversation in messages, over whatever carries them.

use super::msgpack;
use super::value::Value;
use crate::error::Result;
use crate::words::shown;
use serde_json::Value as Json;
use std::time::Duration;
use tungstenite::Bytes;

/// Bytes of a message: an observation has some hundred, with two camera pictures, which are not looked at, less than this.
pub const MOST_MESSAGE_BYTES: usize = 4 << 20;

/// One end of a conversation.
pub trait Link {
    /// Waits for what comes next, for good or as long as `patience` says.
    ///
    /// # Errors
    /// [`crate::error::Error::Interrupted`].
    fn receive(&mut self, patience: Option<Duration>) -> Result<Received>;

    /// Sends a value. Whether the other end is still there shows in [`Link::receive`].
    fn send(&mut self, value: &Value);

    /// Whether the other end takes a message that answers nothing. One that pairs answers with questions would take it for the next answer.
    fn takes_what_it_did_not_ask_for(&self) -> bool;

    /// Says why a message is not answered as it asks.
    fn refuse(&mut self, why: &str);
}

/// What comes over a link.
#[derive(Debug)]
pub enum Received {
    /// A message.
    Message(Message),
    /// Nothing for as long as was waited.
    Silence,
    /// The other end is gone, or what it sends is no such conversation.
    Gone,
}

/// A message as it came.
#[derive(Debug)]
pub enum Message {
    /// msgpack.
    Packed(Bytes),
    /// JSON.
    Json(Json),
    /// Neither: the words say why.
    Unreadable(String),
}

impl Message {
    /// What it holds: a map.
    ///
    /// # Errors
    /// Says what is wrong with it.
    pub fn value(&self) -> std::result::Result<Value<'_>, String> {
        let value = match self {
            Message::Packed(bytes) => msgpack::decode(bytes).map_err(|why| format!("no readable msgpack: {why}"))?,
            Message::Json(json) => Value::of_json(json),
            Message::Unreadable(why) => return Err(shown(why)),
        };
        match value {
            Value::Map(_) => Ok(value),
            other => Err(format!("the message is {}; it must be a map", other.kind())),
        }
    }
}
