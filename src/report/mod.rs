//! Reports for people: pictures of episodes, pages to look at them, charts, curves of training, statistics over seeds, tables on a terminal, runs
//! beside each other, and pages of finished experiments.

pub mod chart;
pub mod compare;
pub mod curves;
pub mod experiments;
pub mod page;
pub mod paper;
pub mod render;
pub mod runs;
pub mod statistics;
pub mod table;
pub mod view;
