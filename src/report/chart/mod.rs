//! Charts as SVG, one family: lines over an axis ([`Chart`]), curves with axes of their own ([`Panels`]), values beside names ([`Rows`]), paths in space ([`Space`]).

mod lines;
mod panels;
mod picture;
mod rows;
mod scale;
mod space;

pub use lines::{Chart, Panel, Point, Series};
pub use panels::{FreeLine, FreePanel, Panels};
pub use picture::{LOOKS, Picture, escaped};
pub use rows::{Datum, Row, Rows};
pub use scale::{Axis, number as tick};
pub use space::{Path, Site, Space};
