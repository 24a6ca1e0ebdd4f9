//! Products compiled for AVX-512 with its instructions for shorter vectors (VL): eight floats as with AVX2, but 32 registers for them, so
//! that a tile is twice as large and reads its operands half as often. The sums are the same to the bit.

use super::operation::Product;
use super::tile::Tile;
use super::vector::Isa;
use crate::nn::lanes::Lanes;
use std::arch::x86_64::__m256;

/// AVX-512VL: 24 of 32 registers hold sums.
pub struct Avx512Vl;

impl Isa for Avx512Vl {
    const TILE_PANELS: usize = 4;
    const TILE_ENTRIES: [usize; 5] = [0, 10, 12, 8, 6];
    #[inline(always)]
    unsafe fn tiles<const S: usize>(panels: usize, entries: usize, count: usize, first: Tile) {
        // SAFETY: the caller's.
        unsafe { any_tiles::<S>(panels, entries, count, first) }
    }
}

#[target_feature(enable = "avx2,fma,avx512f,avx512vl")]
#[inline(never)]
unsafe fn any_tiles<const S: usize>(panels: usize, entries: usize, count: usize, first: Tile) {
    // SAFETY: the caller's.
    unsafe { super::tiles::any_large_tiles::<__m256, S>(panels, entries, count, first) }
}

/// # Safety
/// As [`super::tiles::product`].
#[target_feature(enable = "avx2,fma,avx512f,avx512vl")]
pub unsafe fn product(result: &mut [Lanes], width: usize, of: &Product) {
    // SAFETY: the caller's.
    unsafe { super::tiles::product::<Avx512Vl>(result, width, of) }
}
