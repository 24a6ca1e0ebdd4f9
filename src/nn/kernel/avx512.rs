//! Products compiled for registers of sixteen floats: two neighbouring panels of eight are joined before they are read and parted when they
//! are written, so that samples lie in memory as for every other path. The sums are the same to the bit. A panel that has no neighbour is
//! joined with itself.

use super::operation::Product;
use super::tile::Tile;
use super::tiles::tiles;
use super::vector::{Arithmetic, Isa, Register};
use crate::nn::lanes::Lanes;
use std::arch::x86_64::*;
use std::cell::RefCell;

/// The same entry of two neighbouring panels.
#[derive(Clone, Copy)]
struct Pair(__m512);

impl Arithmetic for Pair {
    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        // SAFETY: the processor has AVX-512F, here and below.
        Pair(unsafe { _mm512_set1_ps(value) })
    }
    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        // SAFETY: as above.
        Pair(unsafe { _mm512_add_ps(self.0, other.0) })
    }
    #[inline(always)]
    unsafe fn times(self, factor: Self) -> Self {
        // SAFETY: as above.
        Pair(unsafe { _mm512_mul_ps(self.0, factor.0) })
    }
    #[inline(always)]
    unsafe fn over(self, divisor: Self) -> Self {
        // SAFETY: as above.
        Pair(unsafe { _mm512_div_ps(self.0, divisor.0) })
    }
    #[inline(always)]
    unsafe fn times_plus(self, factor: Self, summand: Self) -> Self {
        // SAFETY: as above.
        Pair(unsafe { _mm512_fmadd_ps(self.0, factor.0, summand.0) })
    }
    #[inline(always)]
    unsafe fn within(self, limit: f32) -> Self {
        // SAFETY: as above. Both instructions return their second operand when one is NaN.
        Pair(unsafe { _mm512_max_ps(_mm512_set1_ps(-limit), _mm512_min_ps(_mm512_set1_ps(limit), self.0)) })
    }
    #[inline(always)]
    unsafe fn positive(self) -> Self {
        // SAFETY: as above.
        Pair(unsafe { _mm512_max_ps(_mm512_setzero_ps(), self.0) })
    }
    #[inline(always)]
    unsafe fn where_positive(self, y: Self) -> Self {
        // SAFETY: as above.
        Pair(unsafe { _mm512_maskz_mov_ps(_mm512_cmp_ps_mask::<_CMP_GT_OQ>(y.0, _mm512_setzero_ps()), self.0) })
    }
}

impl Register for Pair {
    const COUNT: usize = 2;
    #[inline(always)]
    unsafe fn load_samples(from: *const Lanes) -> Self {
        // SAFETY: as below; they lie in a `Joined`.
        Pair(unsafe { _mm512_load_ps(from.cast()) })
    }
    #[inline(always)]
    unsafe fn load(from: *const Lanes, between: usize) -> Self {
        // SAFETY: the caller's; Lanes are aligned to 32 bytes, and the processor has AVX-512DQ.
        unsafe {
            let first = _mm512_castps256_ps512(_mm256_load_ps(from.cast()));
            Pair(_mm512_insertf32x8::<1>(first, _mm256_load_ps(from.add(between).cast())))
        }
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut Lanes, between: usize) {
        // SAFETY: as `load`.
        unsafe {
            _mm256_store_ps(to.cast(), _mm512_castps512_ps256(self.0));
            _mm256_store_ps(to.add(between).cast(), _mm512_extractf32x8_ps::<1>(self.0));
        }
    }
    #[inline(always)]
    unsafe fn prefetch(soon: *const Lanes) {
        // SAFETY: SSE belongs to x86-64, and a prefetch reads nothing.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(soon.cast()) }
    }
}

/// An entry of two panels side by side.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Joined(#[expect(dead_code, reason = "read by its address")] [Lanes; 2]);

thread_local! {
    /// The samples of the tiles under way. Each is read by several tiles: joined once, they cost one instruction a tile and not two.
    static JOINED: RefCell<Vec<Joined>> = const { RefCell::new(Vec::new()) };
}

/// Joins pairs of panels of `depth` entries; one without a neighbour with itself.
#[target_feature(enable = "avx2,fma,avx512f,avx512vl,avx512dq")]
unsafe fn join(joined: &mut Vec<Joined>, x: &[Lanes], depth: usize) {
    let empty = Joined([Lanes::default(); 2]);
    joined.resize(joined.len().max(x.len().div_ceil(2 * depth) * depth), empty);
    for (pair, to) in x.chunks(2 * depth).zip(joined.chunks_exact_mut(depth)) {
        let between = pair.len() - depth;
        for (from, to) in pair[..depth].iter().zip(to) {
            // SAFETY: entry k of the second panel, or of the only one, lies `between` after entry k of the first.
            unsafe { _mm512_store_ps(std::ptr::from_mut(to).cast(), Pair::load(from, between).0) }
        }
    }
}

/// AVX-512: 26 of 32 registers hold sums.
struct Avx512;

impl Isa for Avx512 {
    const TILE_PANELS: usize = 4;
    const TILE_ENTRIES: [usize; 5] = [0, 13, 13, 13, 13];
    #[inline(always)]
    unsafe fn samples(x: &[Lanes], depth: usize) -> *const Lanes {
        JOINED.with_borrow_mut(|joined| {
            // SAFETY: the caller's.
            unsafe { join(joined, x, depth) };
            joined.as_ptr().cast()
        })
    }
    #[inline(always)]
    unsafe fn tiles<const S: usize>(panels: usize, entries: usize, count: usize, first: Tile) {
        // SAFETY: the caller's.
        unsafe {
            match panels {
                1 | 2 => of_pairs::<S, 1>(entries, count, first.odd(panels == 1)),
                _ => of_pairs::<S, 2>(entries, count, first.odd(panels == 3)),
            }
        }
    }
}

/// The tiles of P pairs compiled for this size.
///
/// # Safety
/// As [`super::tiles::any_tiles`].
#[target_feature(enable = "avx2,fma,avx512f,avx512vl,avx512dq")]
#[inline(never)]
unsafe fn of_pairs<const S: usize, const P: usize>(entries: usize, count: usize, first: Tile) {
    // SAFETY: the caller's.
    unsafe {
        match entries {
            1 => tiles::<Pair, S, P, 1>(count, first),
            2 => tiles::<Pair, S, P, 2>(count, first),
            3 => tiles::<Pair, S, P, 3>(count, first),
            4 => tiles::<Pair, S, P, 4>(count, first),
            5 => tiles::<Pair, S, P, 5>(count, first),
            6 => tiles::<Pair, S, P, 6>(count, first),
            7 => tiles::<Pair, S, P, 7>(count, first),
            8 => tiles::<Pair, S, P, 8>(count, first),
            9 => tiles::<Pair, S, P, 9>(count, first),
            10 => tiles::<Pair, S, P, 10>(count, first),
            11 => tiles::<Pair, S, P, 11>(count, first),
            12 => tiles::<Pair, S, P, 12>(count, first),
            13 => tiles::<Pair, S, P, 13>(count, first),
            _ => unreachable!("no tile spans {entries} entries"),
        }
    }
}

/// # Safety
/// As [`super::tiles::product`].
#[target_feature(enable = "avx2,fma,avx512f,avx512vl,avx512dq")]
pub unsafe fn product(result: &mut [Lanes], width: usize, of: &Product) {
    // SAFETY: the caller's.
    unsafe { super::tiles::product::<Avx512>(result, width, of) }
}

/// `work`, which the compiler takes in here and with it these instructions.
///
/// # Safety
/// The processor has them.
#[target_feature(enable = "avx2,fma,avx512f,avx512vl,avx512dq")]
pub unsafe fn wide<R>(work: impl FnOnce() -> R) -> R {
    work()
}
