//! Curves of training: metrics over its epochs, of several trainings over each other, as a picture and on a terminal.

mod latest;
mod model;
mod model_error;
mod picture;
mod sources;
mod terminal;

pub use latest::latest;
pub use model::{Curve, Plot, plots};
pub use model_error::{ModelErrors, draw_errors, errors_picture, holds_model_errors, model_errors};
pub use picture::picture;
pub use sources::{LIVE, Source, is_pretraining, live_of, sources};
pub use terminal::{Style, columns, draw};
