//! Animated pictures of an episode.

use super::colors::{Palette, UNCHANGED};
use super::{Renderer, RgbImage, check_size, font, label, mark, step_at};
use crate::demo::Episode;
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use gif::{DisposalMethod, Encoder, EncodingError, Extension, Frame, Repeat};
use std::io::Write;

/// How long the last picture stays before the animation starts again \[1/100 s\].
const LAST_DELAY_CS: u16 = 150;
/// Most pictures a second: viewers slow down files that ask for less than 2/100 s a picture.
const MOST_FPS: u32 = 50;

/// What an animation looks like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GifOptions {
    /// \[pixels\].
    pub width: u32,
    /// \[pixels\].
    pub height: u32,
    /// Every how many control steps a picture is taken; the last state is always shown.
    pub every_n_steps: u32,
    /// Pictures a second (rounded to whole 1/100 s a picture). 20 / `every_n_steps` plays in real time.
    pub fps: u32,
}

impl Default for GifOptions {
    /// README size, real time.
    fn default() -> Self {
        GifOptions { width: 480, height: 360, every_n_steps: 2, fps: 10 }
    }
}

/// Writes the episode as an endless animation with one fixed palette: the same bytes on every run. Each picture stores only the
/// rectangle that changed, and in it only the pixels that changed.
///
/// # Errors
/// [`Error::Usage`] for options out of range, [`Error::Failed`] when `out` refuses; [`Error::Interrupted`].
pub fn write_gif<W: Write>(episode: &Episode, options: &GifOptions, interrupt: &Interrupt, out: W) -> Result<()> {
    check_size("an animation", (options.width, options.height))?;
    if options.every_n_steps == 0 || !(1..=MOST_FPS).contains(&options.fps) {
        return Err(Error::Usage(format!(
            "an animation of every {} steps at {} pictures a second: take every 1 step or more, 1 to {MOST_FPS} pictures a second",
            options.every_n_steps, options.fps
        )));
    }
    let failed = |e: EncodingError| Error::Failed(format!("cannot write the animation: {e}"));
    let mut palette = Palette::new();
    let mut encoder = Encoder::new(out, options.width as u16, options.height as u16, &palette.bytes()).map_err(failed)?;
    encoder.set_repeat(Repeat::Infinite).map_err(failed)?;
    encoder.write_raw_extension(Extension::Comment.into(), &[mark().as_bytes()]).map_err(failed)?;
    let mut renderer = Renderer::new(&episode.scene, (options.width, options.height));
    let delay = (100.0 / f64::from(options.fps)).round() as u16;
    let last = episode.steps.len();
    let mut shown: Option<Vec<u8>> = None;
    for step in (0..last).step_by(options.every_n_steps as usize).chain([last]) {
        interrupt.check()?;
        let mut picture = renderer.draw(step_at(episode, step));
        let (text, color) = label(episode, step);
        font::write(&mut picture, &text, color);
        let indices = quantize(&picture, &mut palette);
        let delay = if step == last { LAST_DELAY_CS } else { delay };
        encoder.write_frame(&difference(&indices, shown.as_deref(), options.width as usize, delay)).map_err(failed)?;
        shown = Some(indices);
    }
    encoder.into_inner().map_err(failed)?.flush().map_err(|e| failed(e.into()))
}

fn quantize(picture: &RgbImage, palette: &mut Palette) -> Vec<u8> {
    picture.data.as_chunks::<3>().0.iter().map(|rgb| palette.index(*rgb)).collect()
}

/// The smallest frame that turns `shown` into `now`; one pixel when nothing changed, so that its time still passes.
fn difference(now: &[u8], shown: Option<&[u8]>, width: usize, delay: u16) -> Frame<'static> {
    let height = now.len() / width;
    let changed = |x: usize, y: usize| shown.is_none_or(|s| s[y * width + x] != now[y * width + x]);
    let row_changed = |y: &usize| (0..width).any(|x| changed(x, *y));
    let top = (0..height).find(row_changed).unwrap_or(0);
    let bottom = (top..height).rev().find(row_changed).unwrap_or(top);
    let column_changed = |x: &usize| (top..=bottom).any(|y| changed(*x, y));
    let left = (0..width).find(column_changed).unwrap_or(0);
    let right = (left..width).rev().find(column_changed).unwrap_or(left);
    let pixel = |x: usize, y: usize| if changed(x, y) { now[y * width + x] } else { UNCHANGED };
    let buffer: Vec<u8> = (top..=bottom).flat_map(|y| (left..=right).map(move |x| pixel(x, y))).collect();
    Frame {
        delay,
        dispose: DisposalMethod::Keep,
        transparent: Some(UNCHANGED),
        left: left as u16,
        top: top as u16,
        width: (right - left + 1) as u16,
        height: (bottom - top + 1) as u16,
        buffer: buffer.into(),
        ..Frame::default()
    }
}
