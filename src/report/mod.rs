//! Reports for people: pictures of episodes, charts, and tables on a terminal.

pub mod chart;
pub mod render;
pub mod table;
