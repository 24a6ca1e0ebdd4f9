//! Datasets that other programs wrote: learning from them, and the tools of `hilt dataset`.

mod learning;
mod made;
mod page;
mod tools;
