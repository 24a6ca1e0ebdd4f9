//! Charts as SVG, one family: lines over an axis ([`Chart`]), values beside names ([`Rows`]), paths in space ([`Space`]).

mod lines;
mod picture;
mod rows;
mod scale;
mod space;

pub use lines::{Chart, Panel, Point, Series};
pub use picture::{LOOKS, Picture, escaped};
pub use rows::{Datum, Row, Rows};
pub use scale::Axis;
pub use space::{Path, Site, Space};
