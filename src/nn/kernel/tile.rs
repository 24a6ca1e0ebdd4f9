//! The addresses of one register tile.

use super::operation::{Coefficients, Finish, Product, Start};
use crate::nn::lanes::{LANES, Lanes};

/// The addresses of one register tile.
#[derive(Clone, Copy)]
pub struct Tile {
    pub result: *mut Lanes,
    pub width: usize,
    pub x: *const Lanes,
    pub depth: usize,
    /// Whether the last register's last panel is missing.
    pub odd: bool,
    pub a: *const f32,
    /// Coefficients lie in `blocks` of `inner`; distances in floats.
    pub blocks: usize,
    pub between_blocks: usize,
    pub inner: usize,
    pub between_k: usize,
    pub start: TileStart,
    pub finish: TileFinish,
}

/// As [`Start`], by address.
#[derive(Clone, Copy)]
pub enum TileStart {
    Zero,
    Result,
    Bias(*const f32),
}

/// As [`Finish`], by address.
#[derive(Clone, Copy)]
pub enum TileFinish {
    Nothing,
    Tanh,
    Relu,
    TanhSlope(*const Lanes),
    ReluSlope(*const Lanes),
}

impl Tile {
    /// The tile whose first entry is `f` of panel `p`, its samples at `x`.
    ///
    /// # Safety
    /// That entry exists.
    #[inline(always)]
    pub unsafe fn new(result: &mut [Lanes], width: usize, of: &Product, x: *const Lanes, p: usize, f: usize) -> Tile {
        let (place, depth) = (p * width + f, of.depth);
        // SAFETY: the caller's.
        unsafe {
            let (a, blocks, between_blocks, inner, between_k) = match of.a {
                Coefficients::Matrix(values) => (values.as_ptr().add(f), 1, 0, depth, width),
                Coefficients::Samples(samples) => (samples.as_ptr().add(f).cast(), depth / LANES, LANES * width, LANES, 1),
            };
            let start = match of.start {
                Start::Zero => TileStart::Zero,
                Start::Result => TileStart::Result,
                Start::Bias(bias) => TileStart::Bias(bias.as_ptr().add(f)),
            };
            let finish = match of.finish {
                Finish::Nothing => TileFinish::Nothing,
                Finish::Tanh => TileFinish::Tanh,
                Finish::Relu => TileFinish::Relu,
                Finish::TanhSlope(y) => TileFinish::TanhSlope(y.as_ptr().add(place)),
                Finish::ReluSlope(y) => TileFinish::ReluSlope(y.as_ptr().add(place)),
            };
            let result = result.as_mut_ptr().add(place);
            Tile { result, width, x, depth, odd: false, a, blocks, between_blocks, inner, between_k, start, finish }
        }
    }

    /// The same tile, where the last register has a panel less than it could hold: the one before stands in its place, too.
    #[inline(always)]
    pub fn odd(self, odd: bool) -> Tile {
        Tile { odd, ..self }
    }

    /// The tile that begins `entries` later, coefficients of neighbouring entries being `between` floats apart.
    #[inline(always)]
    pub fn next(self, entries: usize, between: usize) -> Tile {
        Tile {
            result: self.result.wrapping_add(entries),
            a: self.a.wrapping_add(entries * between),
            start: match self.start {
                TileStart::Bias(bias) => TileStart::Bias(bias.wrapping_add(entries)),
                other => other,
            },
            finish: match self.finish {
                TileFinish::TanhSlope(y) => TileFinish::TanhSlope(y.wrapping_add(entries)),
                TileFinish::ReluSlope(y) => TileFinish::ReluSlope(y.wrapping_add(entries)),
                other => other,
            },
            ..self
        }
    }
}
