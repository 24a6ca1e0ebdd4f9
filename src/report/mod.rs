//! Reports for people: pictures of episodes and tables on a terminal.

pub mod render;
pub mod table;
