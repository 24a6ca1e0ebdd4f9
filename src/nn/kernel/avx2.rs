//! The compilation for AVX2 with FMA. Every function here needs a processor that has both.

use super::operation::Product;
use super::tile::Tile;
use super::vector::{Arithmetic, Isa, Vector};
use crate::nn::lanes::{LANES, Lanes};
use std::arch::x86_64::*;

impl Arithmetic for __m256 {
    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        // SAFETY: the processor has AVX2; so below.
        unsafe { _mm256_set1_ps(value) }
    }
    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        // SAFETY: as above.
        unsafe { _mm256_add_ps(self, other) }
    }
    #[inline(always)]
    unsafe fn times(self, factor: Self) -> Self {
        // SAFETY: as above.
        unsafe { _mm256_mul_ps(self, factor) }
    }
    #[inline(always)]
    unsafe fn over(self, divisor: Self) -> Self {
        // SAFETY: as above.
        unsafe { _mm256_div_ps(self, divisor) }
    }
    #[inline(always)]
    unsafe fn times_plus(self, factor: Self, summand: Self) -> Self {
        // SAFETY: the processor has FMA.
        unsafe { _mm256_fmadd_ps(self, factor, summand) }
    }
    #[inline(always)]
    unsafe fn within(self, limit: f32) -> Self {
        // SAFETY: as above. Both instructions return their second operand when one is NaN.
        unsafe { _mm256_max_ps(_mm256_set1_ps(-limit), _mm256_min_ps(_mm256_set1_ps(limit), self)) }
    }
    #[inline(always)]
    unsafe fn positive(self) -> Self {
        // SAFETY: as above.
        unsafe { _mm256_max_ps(_mm256_setzero_ps(), self) }
    }
    #[inline(always)]
    unsafe fn where_positive(self, y: Self) -> Self {
        // SAFETY: as above.
        unsafe { _mm256_and_ps(self, _mm256_cmp_ps::<_CMP_GT_OQ>(y, _mm256_setzero_ps())) }
    }
}

impl Vector for __m256 {
    #[inline(always)]
    unsafe fn load(from: *const Lanes) -> Self {
        // SAFETY: the caller's; Lanes are aligned to 32 bytes.
        unsafe { _mm256_load_ps(from.cast()) }
    }
    #[inline(always)]
    unsafe fn load_row(from: *const f32) -> Self {
        // SAFETY: the caller's.
        unsafe { _mm256_loadu_ps(from) }
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut Lanes) {
        // SAFETY: as `load`.
        unsafe { _mm256_store_ps(to.cast(), self) }
    }
    #[inline(always)]
    unsafe fn store_row(self, to: *mut f32) {
        // SAFETY: the caller's.
        unsafe { _mm256_storeu_ps(to, self) }
    }
    #[inline(always)]
    unsafe fn transposed(v: [Self; LANES]) -> [Self; LANES] {
        // SAFETY: as above.
        unsafe {
            // pairs of rows, then quadruples, then halves
            let pair = |i: usize| [_mm256_unpacklo_ps(v[i], v[i + 1]), _mm256_unpackhi_ps(v[i], v[i + 1])];
            let pairs = [pair(0), pair(2), pair(4), pair(6)];
            let quad = |i: usize, k: usize| {
                let (a, b) = (pairs[i][k], pairs[i + 1][k]);
                [_mm256_shuffle_ps::<0x44>(a, b), _mm256_shuffle_ps::<0xEE>(a, b)]
            };
            let (low, high) = ([quad(0, 0), quad(0, 1)], [quad(2, 0), quad(2, 1)]);
            std::array::from_fn(|r| {
                let (low, high) = (low[r % 4 / 2][r % 2], high[r % 4 / 2][r % 2]);
                if r < 4 { _mm256_permute2f128_ps::<0x20>(low, high) } else { _mm256_permute2f128_ps::<0x31>(low, high) }
            })
        }
    }
    #[inline(always)]
    unsafe fn prefetch(soon: *const Lanes) {
        // SAFETY: SSE belongs to x86-64, and a prefetch reads nothing.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(soon.cast()) }
    }
}

/// AVX2 with FMA: 12 of 16 registers hold sums.
pub struct Avx2;

impl Isa for Avx2 {
    const TILE_PANELS: usize = 2;
    const TILE_ENTRIES: [usize; 5] = [0, 10, 6, 3, 0];
    #[inline(always)]
    unsafe fn tiles<const S: usize>(panels: usize, entries: usize, count: usize, first: Tile) {
        // SAFETY: the caller's.
        unsafe { any_tiles::<S>(panels, entries, count, first) }
    }
}

#[target_feature(enable = "avx2,fma")]
#[inline(never)]
unsafe fn any_tiles<const S: usize>(panels: usize, entries: usize, count: usize, first: Tile) {
    // SAFETY: the caller's.
    unsafe { super::tiles::any_tiles::<__m256, S>(panels, entries, count, first) }
}

/// # Safety
/// As [`super::tiles::product`].
#[target_feature(enable = "avx2,fma")]
pub unsafe fn product(result: &mut [Lanes], width: usize, of: &Product) {
    // SAFETY: the caller's.
    unsafe { super::tiles::product::<Avx2>(result, width, of) }
}

#[target_feature(enable = "avx2,fma")]
pub fn tanh(y: &mut [Lanes]) {
    // SAFETY: this function has T's instructions; so below.
    unsafe { super::entries::tanh_all::<__m256>(y) }
}

#[target_feature(enable = "avx2,fma")]
pub fn transpose(to: &mut [Lanes], from: &[Lanes], entries: usize) {
    // SAFETY: as above.
    unsafe { super::entries::transpose::<__m256>(to, from, entries) }
}

/// # Safety
/// As [`super::entries::interleave`].
#[target_feature(enable = "avx2,fma")]
pub unsafe fn interleave(panel: &mut [Lanes], rows: [&[f32]; LANES]) {
    // SAFETY: the caller's.
    unsafe { super::entries::interleave::<__m256>(panel, rows) }
}

/// # Safety
/// As [`super::entries::separate`].
#[target_feature(enable = "avx2,fma")]
pub unsafe fn separate(rows: [&mut [f32]; LANES], panel: &[Lanes]) {
    // SAFETY: the caller's.
    unsafe { super::entries::separate::<__m256>(rows, panel) }
}

/// `work`, which the compiler takes in here and with it these instructions.
///
/// # Safety
/// The processor has them.
#[target_feature(enable = "avx2,fma")]
pub unsafe fn wide<R>(work: impl FnOnce() -> R) -> R {
    work()
}
