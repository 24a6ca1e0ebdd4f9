//! What every stage gets, and how it ends.

use super::console::Console;
use crate::interrupt::Interrupt;

/// How a stage that did not fail ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All is done.
    Done,
    /// Done, but this many episodes were dropped.
    Dropped(u64),
}

impl Outcome {
    /// The exit code of [`Outcome::Dropped`].
    pub const DROPPED_CODE: u8 = 3;
}

/// What every stage gets beside its arguments.
#[derive(Debug)]
pub struct Context {
    /// Words and progress.
    pub console: Console,
    /// Ctrl-C.
    pub interrupt: Interrupt,
}
