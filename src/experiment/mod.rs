//! Experiments as data: a file with a grid of tasks, presets, variations, methods and seeds becomes the commands of `plan` to `evaluate`, each once.
//!
//! [`Experiment`] is what the file says, [`Grid`] its runs and the [`Step`]s that they share. A step is a command line with inputs and outputs;
//! whether it is done, its artefact says ([`state`]). Another program can run the steps as well ([`emit`]); this module starts none.

mod builder;
pub mod emit;
pub mod estimate;
mod file;
mod grid;
pub mod leftovers;
pub mod place;
mod report_kind;
mod resolve;
pub mod results;
mod runs;
mod seeds;
mod spec;
pub mod state;
mod step;
mod variation;
mod wording;

pub use file::{DIRECTORY, all, find};
pub use report_kind::ReportKind;
pub use runs::{Grid, Run};
pub use seeds::{Seeds, seeds_of};
pub use spec::{Experiment, Overrides, Variation};
pub use step::{Input, Output, Step};

#[cfg(test)]
mod tests;
