//! Floats that instructions work on at once.

use super::tile::Tile;
use crate::nn::lanes::{LANES, Lanes};

/// Floats that instructions work on at once, each by itself.
///
/// # Safety
/// Every function needs the processor to have the vector's instructions, and its addresses to be valid.
pub trait Arithmetic: Copy {
    unsafe fn splat(value: f32) -> Self;
    /// self + other.
    unsafe fn add(self, other: Self) -> Self;
    /// self * factor.
    unsafe fn times(self, factor: Self) -> Self;
    /// self / divisor.
    unsafe fn over(self, divisor: Self) -> Self;
    /// self * factor + summand, rounded once.
    unsafe fn times_plus(self, factor: Self, summand: Self) -> Self;
    /// The nearest number to self between -limit and limit; NaN stays.
    unsafe fn within(self, limit: f32) -> Self;
    /// max(0, self); NaN stays.
    unsafe fn positive(self) -> Self;
    /// self where `y` is above 0, else 0.
    unsafe fn where_positive(self, y: Self) -> Self;
}

/// A vector of eight floats.
///
/// # Safety
/// As [`Arithmetic`].
pub trait Vector: Arithmetic {
    unsafe fn load(from: *const Lanes) -> Self;
    /// Eight floats, not aligned.
    unsafe fn load_row(from: *const f32) -> Self;
    unsafe fn store(self, to: *mut Lanes);
    /// Eight floats, not aligned.
    unsafe fn store_row(self, to: *mut f32);
    /// Element i of vector r becomes element r of vector i.
    unsafe fn transposed(square: [Self; LANES]) -> [Self; LANES];
    /// Asks the processor to bring this into its cache while it works on something else; without effect on any result.
    unsafe fn prefetch(soon: *const Lanes);
}

/// One entry of as many neighbouring panels as a register holds.
///
/// # Safety
/// As [`Arithmetic`].
pub trait Register: Arithmetic {
    /// How many panels.
    const COUNT: usize;
    /// The same entry of samples that lie as [`Isa::samples`] has them.
    unsafe fn load_samples(from: *const Lanes) -> Self;
    /// The entry at `from` and its like in the panels after, `between` entries apart.
    unsafe fn load(from: *const Lanes, between: usize) -> Self;
    unsafe fn store(self, to: *mut Lanes, between: usize);
    /// As [`Vector::prefetch`].
    unsafe fn prefetch(soon: *const Lanes);
}

impl<V: Vector> Register for V {
    const COUNT: usize = 1;
    #[inline(always)]
    unsafe fn load_samples(from: *const Lanes) -> Self {
        // SAFETY: the caller's, here and below.
        unsafe { V::load(from) }
    }
    #[inline(always)]
    unsafe fn load(from: *const Lanes, _: usize) -> Self {
        // SAFETY: as above.
        unsafe { V::load(from) }
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut Lanes, _: usize) {
        // SAFETY: as above.
        unsafe { V::store(self, to) }
    }
    #[inline(always)]
    unsafe fn prefetch(soon: *const Lanes) {
        // SAFETY: as above.
        unsafe { V::prefetch(soon) }
    }
}

/// An instruction set: the tiles that its registers hold.
pub trait Isa {
    /// Panels of a tile, where there are enough.
    const TILE_PANELS: usize;
    /// The most entries that a register tile of 1, 2, 3 or 4 panels spans: as many sums as leave registers for the operands, and at
    /// least 8, which hide the latency of FMA. A single panel is bound by loads, whatever it spans.
    const TILE_ENTRIES: [usize; 5];
    /// Where the tiles of these panels read their samples: register by register, an entry of a register's panels after the other. What is
    /// returned holds until this thread asks again.
    ///
    /// # Safety
    /// The processor has the instructions.
    #[inline(always)]
    unsafe fn samples(x: &[Lanes], _depth: usize) -> *const Lanes {
        x.as_ptr()
    }
    /// [`super::tiles::any_tiles`], compiled by itself: merged into its caller the compiler would know `inner` and unroll that loop, to
    /// its harm.
    ///
    /// # Safety
    /// As there.
    unsafe fn tiles<const S: usize>(panels: usize, entries: usize, count: usize, first: Tile);
}
