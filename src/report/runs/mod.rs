//! Runs as they stand on the disk: a directory with the artefacts of some stages, made by `make all`, by an experiment or by hand.
//!
//! An artefact is known by what it says of itself, not by its name, and belongs to a run when the next stage says that it was made from it.

mod artefacts;
mod beside;
mod list;
mod run;
mod stamp;
mod standing;
mod words;

pub use artefacts::{Artefact, artefacts, is_run};
pub use beside::{list_json, list_text};
pub use list::{Row, list};
pub use run::{Judged, Run};
pub use standing::{Condition, Standing};
