//! Curves of training: metrics over its epochs, of several trainings over each other, as a picture and on a terminal.

mod latest;
mod model;
mod picture;
mod sources;
mod terminal;

pub use latest::latest;
pub use model::{Curve, Plot, plots};
pub use picture::picture;
pub use sources::{Source, live_of, sources};
pub use terminal::{Style, columns, draw};
