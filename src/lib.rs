//! hilt: hybrid imitation learning for robot manipulation, from a task's name to an evaluated policy.
#![warn(missing_docs)]

pub mod cmd;
pub mod config;
pub mod data;
pub mod demo;
pub mod error;
pub mod eval;
pub mod interrupt;
pub mod learn;
pub mod nn;
pub mod plan;
pub mod pulse;
pub mod report;
pub mod robot;
pub mod scene;
pub mod seed;
pub mod sim;
pub mod state;
pub mod table;
pub mod tasks;
pub mod tensor;
