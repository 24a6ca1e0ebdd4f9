//! Policies and worlds over a wire: openpi's WebSocket protocol of msgpack with NumPy's arrays, or lines of JSON.
//!
//! - [`PolicyHost`]: a policy of hilt's, for a robot or for other programs that evaluate
//! - [`WorldHost`]: the simulated task, for other programs that learn or evaluate in it
//! - [`RemotePolicy`]: a policy that somebody else serves, in hilt's evaluation
//!
//! What comes in is of strangers: sizes, depths, types and times have limits, and nothing in it is ever executed.

mod access;
mod array;
mod asked;
mod bounds;
mod client;
mod dial;
mod handshake;
mod lines;
mod link;
mod msgpack;
mod paced;
mod policy;
mod rows;
mod seats;
mod server;
mod session;
mod socket;
mod told;
mod value;
mod world;

pub use access::{Token, check_address, read_token};
pub use array::{Array, Dtype};
pub use client::RemotePolicy;
pub use lines::LineLink;
pub use link::{Link, MOST_MESSAGE_BYTES, Message, Received};
pub use msgpack::{decode, encode};
pub use policy::PolicyHost;
pub use server::{Host, Server};
pub use session::PolicyOptions;
pub use value::{Numbers, Value};
pub use world::WorldHost;
