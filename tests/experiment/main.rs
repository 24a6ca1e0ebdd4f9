//! `hilt experiment` as a process: what a sweep leaves, killed, interrupted, changed, wrong.

mod bad_input;
mod edited;
mod ends;
mod files;
mod kills;
mod others;
mod sweep;
