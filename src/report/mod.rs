//! Reports for people: pictures of episodes, pages to look at them, charts, statistics over seeds, tables on a terminal, and pages of finished experiments.

pub mod chart;
pub mod experiments;
pub mod page;
pub mod paper;
pub mod render;
pub mod statistics;
pub mod table;
pub mod view;
