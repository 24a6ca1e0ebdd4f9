//! Contact sheets: evenly spaced pictures of an episode in one PNG file.

use super::{Renderer, RgbImage, check_size, font, label, mark, step_at};
use crate::demo::Episode;
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use std::io::Write;

/// Pixels between two tiles.
const GAP_PX: u32 = 4;
/// Most columns or rows of a sheet.
const MOST: u32 = 32;
/// Most pixels of a sheet: 300 MB in memory, more than viewers show.
const MOST_PIXELS: u64 = 100_000_000;

/// Writes `columns` x `rows` pictures of `size` pixels each, evenly spaced from the first state to the last, left to right and top
/// to bottom, each with its time, phase and, on the last, the outcome.
///
/// # Errors
/// [`Error::Usage`] for a tile or a grid of impossible size, [`Error::Failed`] when `out` refuses; [`Error::Interrupted`].
pub fn write_png_sheet<W: Write>(
    episode: &Episode,
    (columns, rows): (u32, u32),
    size: (u32, u32),
    interrupt: &Interrupt,
    out: W,
) -> Result<()> {
    check_size("a tile", size)?;
    if !(1..=MOST).contains(&columns) || !(1..=MOST).contains(&rows) {
        return Err(Error::Usage(format!("a sheet of {columns} x {rows} pictures: columns and rows must be 1 to {MOST}")));
    }
    let pixels = u64::from(columns) * u64::from(rows) * u64::from(size.0) * u64::from(size.1);
    if pixels > MOST_PIXELS {
        return Err(Error::Usage(format!(
            "a sheet of {columns} x {rows} pictures of {} x {} pixels has {pixels}: at most {MOST_PIXELS}; take fewer or smaller \
             pictures",
            size.0, size.1
        )));
    }
    let sheet = sheet(episode, (columns, rows), size, interrupt)?;
    write_png(&sheet, out).map_err(|e| Error::Failed(format!("cannot write the picture: {e}")))
}

fn sheet(episode: &Episode, (columns, rows): (u32, u32), size: (u32, u32), interrupt: &Interrupt) -> Result<RgbImage> {
    let (width, height) = (columns * (size.0 + GAP_PX) - GAP_PX, rows * (size.1 + GAP_PX) - GAP_PX);
    let mut sheet = RgbImage { width, height, data: [255; 3].repeat(width as usize * height as usize) };
    let mut renderer = Renderer::new(&episode.scene, size);
    let tiles = columns * rows;
    for tile in 0..tiles {
        interrupt.check()?;
        // A single picture shows the end.
        let share = if tiles == 1 { 1.0 } else { f64::from(tile) / f64::from(tiles - 1) };
        let step = (share * episode.steps.len() as f64).round() as usize;
        let mut picture = renderer.draw(step_at(episode, step));
        let (text, color) = label(episode, step);
        font::write(&mut picture, &text, color);
        paste(&mut sheet, &picture, tile % columns * (size.0 + GAP_PX), tile / columns * (size.1 + GAP_PX));
    }
    Ok(sheet)
}

/// Puts a picture into a larger one.
pub(super) fn paste(sheet: &mut RgbImage, picture: &RgbImage, left: u32, top: u32) {
    for (y, row) in picture.data.chunks_exact(picture.width as usize * 3).enumerate() {
        let start = ((top as usize + y) * sheet.width as usize + left as usize) * 3;
        sheet.data[start..start + row.len()].copy_from_slice(row);
    }
}

/// As a PNG file.
pub(in crate::report) fn write_png<W: Write>(image: &RgbImage, out: W) -> std::result::Result<(), png::EncodingError> {
    let mut encoder = png::Encoder::new(out, image.width, image.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.add_text_chunk("Software".into(), mark())?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&image.data)?;
    writer.finish()
}
