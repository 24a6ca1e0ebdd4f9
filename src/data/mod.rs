//! Files: the only place that knows MCAP, Arrow, Parquet, safetensors, ONNX, CSV and TensorBoard's events.
//!
//! Every artefact is written beside its place and renamed when whole ([`atomic`]), says where it came from ([`provenance`]) and
//! carries a seal over its own bytes ([`seal`]), so that a damaged file is refused before any decoder reads it.

pub mod atomic;
mod budget;
mod bytes;
mod content_hash;
pub mod csv;
pub mod dataset;
pub mod differences;
mod inspect;
pub mod json_file;
mod json_text;
mod litter;
pub mod live_file;
pub mod marked;
pub mod onnx;
pub mod origin;
mod parquet_file;
mod parquet_limits;
mod parquet_stream;
pub mod peek;
mod proto;
pub mod provenance;
pub mod recording;
pub mod seal;
pub mod table_file;
pub mod tensorboard;
mod thrift;
pub mod weights;

pub use content_hash::ContentHash;
pub use inspect::{inspect, inspect_text};
pub use provenance::Provenance;
