//! The compilation for any processor.

use super::fused;
use super::tile::Tile;
use super::tiles::any_tiles;
use super::vector::{Arithmetic, Isa, Vector};
use crate::nn::lanes::{LANES, Lanes};

/// What every processor has: as many sums as with AVX2. Without an instruction for fused multiply-add, one is done in software.
pub struct Portable;

impl Isa for Portable {
    const TILE_PANELS: usize = 2;
    const TILE_ENTRIES: [usize; 5] = [0, 10, 6, 3, 0];
    #[inline(never)]
    unsafe fn tiles<const S: usize>(panels: usize, entries: usize, count: usize, first: Tile) {
        // SAFETY: the caller's.
        unsafe { any_tiles::<Lanes, S>(panels, entries, count, first) }
    }
}

impl Arithmetic for Lanes {
    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        Lanes::splat(value)
    }
    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        self + other
    }
    #[inline(always)]
    unsafe fn times(self, factor: Self) -> Self {
        self * factor
    }
    #[inline(always)]
    unsafe fn over(self, divisor: Self) -> Self {
        Lanes(std::array::from_fn(|i| self.0[i] / divisor.0[i]))
    }
    #[inline(always)]
    unsafe fn times_plus(self, factor: Self, summand: Self) -> Self {
        let fused = if cfg!(any(target_arch = "aarch64", target_feature = "fma")) { f32::mul_add } else { fused::times_plus };
        Lanes(std::array::from_fn(|i| fused(self.0[i], factor.0[i], summand.0[i])))
    }
    #[inline(always)]
    unsafe fn within(self, limit: f32) -> Self {
        self.map(|v| if v > limit { limit } else { v }).map(|v| if v < -limit { -limit } else { v })
    }
    #[inline(always)]
    unsafe fn positive(self) -> Self {
        self.map(|v| if v < 0.0 { 0.0 } else { v })
    }
    #[inline(always)]
    unsafe fn where_positive(self, y: Self) -> Self {
        Lanes(std::array::from_fn(|i| if y.0[i] > 0.0 { self.0[i] } else { 0.0 }))
    }
}

impl Vector for Lanes {
    #[inline(always)]
    unsafe fn load(from: *const Lanes) -> Self {
        // SAFETY: the caller's.
        unsafe { *from }
    }
    #[inline(always)]
    unsafe fn load_row(from: *const f32) -> Self {
        // SAFETY: the caller's; floats lie side by side in an array.
        Lanes(unsafe { *from.cast::<[f32; LANES]>() })
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut Lanes) {
        // SAFETY: the caller's.
        unsafe { *to = self }
    }
    #[inline(always)]
    unsafe fn store_row(self, to: *mut f32) {
        // SAFETY: as `load_row`.
        unsafe { *to.cast::<[f32; LANES]>() = self.0 }
    }
    #[inline(always)]
    unsafe fn transposed(square: [Self; LANES]) -> [Self; LANES] {
        std::array::from_fn(|r| Lanes(std::array::from_fn(|i| square[i].0[r])))
    }
    #[inline(always)]
    unsafe fn prefetch(_: *const Lanes) {}
}
