//! What listens, from outside: answers, limits, hostile clients, refusals, and episodes that are the same over a wire.

mod bad_input;
mod ends;
mod episodes;
mod hostile;
mod lines;
mod servers;
