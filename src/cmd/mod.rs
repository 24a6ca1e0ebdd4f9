//! The command line: one stage, one file, `Args` (its doc comment is its help) and `run`; no logic of its own.

mod checkpoint;
mod cli;
mod common;
mod console;
mod context;
mod convert;
mod dataset;
mod dropped;
mod epochs;
mod evaluate;
mod experiment;
mod export;
mod inspect;
mod learning;
mod listen;
mod output;
mod page;
mod places;
mod plan;
mod pretrain;
mod render;
mod replay;
mod report;
mod robot;
mod serve;
mod serve_env;
mod settings;
mod shard;
mod simulate;
mod subject;
mod train;
mod unfinished;
mod view;

pub use cli::Cli;
pub use console::{Console, Progress};
pub use context::{Context, Outcome};
