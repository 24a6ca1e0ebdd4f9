//! Matrix products, tile by tile: the sums of a tile stay in registers.

use super::entries::{tanh, tanh_slope};
use super::operation::{Coefficients, Product};
use super::tile::{Tile, TileFinish, TileStart};
use super::vector::{Isa, Register, Vector};
use crate::nn::lanes::{LANES, Lanes};

/// The product, tile by tile.
///
/// # Safety
/// The lengths fit as [`super::product`] says, and the processor has T's instructions.
#[inline(always)]
pub unsafe fn product<T: Isa>(result: &mut [Lanes], width: usize, of: &Product) {
    let mut p = 0;
    for (panels, times) in spans(of.x.len() / of.depth, T::TILE_PANELS) {
        for _ in 0..times {
            // SAFETY: the processor has T's instructions.
            let x = unsafe { T::samples(&of.x[p * of.depth..(p + panels) * of.depth], of.depth) };
            let mut f = 0;
            for (entries, count) in runs(width, T::TILE_ENTRIES[panels]) {
                // SAFETY: the tiles read entries 0..depth of panels p.. of x, biases f.. and activations at the result's place, and write
                // entries f.. of panels p.. of the result, all within their arrays; they read a(k, f) for k < depth and f < width, in
                // a matrix that is number k * width + f < depth * width, among samples number (k / 8 * width + f) * 8 + k % 8 < depth
                // * width. `result` is borrowed mutably: nothing else aliases it.
                unsafe {
                    match of.a {
                        Coefficients::Matrix(_) => T::tiles::<1>(panels, entries, count, Tile::new(result, width, of, x, p, f)),
                        Coefficients::Samples(_) => {
                            T::tiles::<LANES>(panels, entries, count, Tile::new(result, width, of, x, p, f))
                        }
                    }
                }
                f += entries * count;
            }
            p += panels;
        }
    }
}

/// Panels of a tile, and how many times: `most` (2 or 4) at a time; a panel that would be left alone goes with those before it, as
/// three, or as three and two.
#[inline(always)]
pub fn spans(panels: usize, most: usize) -> impl Iterator<Item = (usize, usize)> {
    let (whole, last) = match (panels / most, panels % most) {
        (whole, 1) if whole > 0 => (whole - 1, [3, most - 2]),
        (whole, rest) => (whole, [rest, 0]),
    };
    [(most, whole), (last[0], 1), (last[1], 1)].into_iter().filter(|(panels, times)| *panels > 0 && *times > 0)
}

/// n as the fewest parts of at most `most`, as even as can be: sizes, and how many parts have them.
#[inline(always)]
pub fn runs(n: usize, most: usize) -> impl Iterator<Item = (usize, usize)> {
    let count = n.div_ceil(most);
    let (least, longer) = (n / count.max(1), n % count.max(1));
    [(least + 1, longer), (least, count - longer)].into_iter().filter(|(_, count)| *count > 0)
}

/// `count` tiles of P registers' panels and F entries side by side, a(k, f) and a(k, f + 1) being S floats apart.
///
/// # Safety
/// Every address lies within its array, and the processor has V's instructions.
#[inline(always)]
pub unsafe fn tiles<V: Register, const S: usize, const P: usize, const F: usize>(count: usize, first: Tile) {
    let mut tile = first;
    for _ in 0..count {
        // SAFETY: the caller's.
        unsafe {
            if let TileFinish::TanhSlope(y) | TileFinish::ReluSlope(y) = tile.finish {
                let lines = (0..P * V::COUNT).flat_map(|p| (0..F).step_by(2).map(move |f| p * tile.width + f));
                lines.for_each(|at| V::prefetch(y.wrapping_add(at)));
            }
            let sums = sums::<V, S, P, F>(&tile);
            finish::<V, P, F>(&tile, sums);
        }
        tile = tile.next(F, S);
    }
}

#[inline(always)]
unsafe fn sums<V: Register, const S: usize, const P: usize, const F: usize>(tile: &Tile) -> [[V; P]; F] {
    // SAFETY: the caller's.
    unsafe {
        let mut sums = [[V::splat(0.0); P]; F];
        let (mut x, mut block) = (tile.x, tile.a);
        for _ in 0..tile.blocks {
            let mut a = block;
            for _ in 0..tile.inner {
                step::<V, S, P, F>(&mut sums, a, x, tile.depth);
                (a, x) = (a.wrapping_add(tile.between_k), x.wrapping_add(V::COUNT));
            }
            block = block.wrapping_add(tile.between_blocks);
        }
        sums
    }
}

/// Adds one k to the sums: its coefficients begin at `a`, its samples at `x`.
#[inline(always)]
unsafe fn step<V: Register, const S: usize, const P: usize, const F: usize>(
    sums: &mut [[V; P]; F],
    a: *const f32,
    x: *const Lanes,
    depth: usize,
) {
    // SAFETY: the caller's.
    unsafe {
        let samples: [V; P] = std::array::from_fn(|p| V::load_samples(x.wrapping_add(p * V::COUNT * depth)));
        for (f, sums) in sums.iter_mut().enumerate() {
            let a = V::splat(*a.add(f * S));
            for (sum, sample) in sums.iter_mut().zip(samples) {
                *sum = sample.times_plus(a, *sum);
            }
        }
    }
}

/// `$each` for every entry f and panel p of a tile of F entries, written out: in loops the sums would lie in memory.
macro_rules! each {
    ($sums:ident, |$f:ident, $p:ident, $sum:ident| $each:expr) => {{
        const { assert!(F <= 13, "an entry for each number below") }
        each!($sums, |$f, $p, $sum| $each, 0 1 2 3 4 5 6 7 8 9 10 11 12)
    }};
    ($sums:ident, |$f:ident, $p:ident, $sum:ident| $each:expr, $($entry:literal)*) => {{
        $(
            if $entry < F {
                let $f = $entry;
                for ($p, $sum) in $sums[$entry].iter_mut().enumerate() {
                    $each;
                }
            }
        )*
    }};
}

/// What the sums begin with and what is made of them, asked once a tile: asked once a sum it takes a hundred cycles.
#[inline(always)]
unsafe fn finish<V: Register, const P: usize, const F: usize>(tile: &Tile, mut sums: [[V; P]; F]) {
    let (width, last) = (tile.width, if tile.odd { 0 } else { tile.width });
    let place = |f: usize, p: usize| p * V::COUNT * width + f;
    let between = |p: usize| if p + 1 < P { width } else { last };
    // SAFETY: the caller's; `place` is where entry f of register p's first panel lies after the tile's first.
    unsafe {
        match tile.start {
            TileStart::Zero => {}
            TileStart::Result => each!(sums, |f, p, sum| *sum = sum.add(V::load(tile.result.add(place(f, p)), between(p)))),
            TileStart::Bias(bias) => each!(sums, |f, _p, sum| *sum = sum.add(V::splat(*bias.add(f)))),
        }
        match tile.finish {
            TileFinish::Nothing => {}
            TileFinish::Tanh => each!(sums, |_f, _p, sum| *sum = tanh(*sum)),
            TileFinish::Relu => each!(sums, |_f, _p, sum| *sum = sum.positive()),
            TileFinish::TanhSlope(y) => each!(sums, |f, p, sum| *sum = tanh_slope(*sum, V::load(y.add(place(f, p)), between(p)))),
            TileFinish::ReluSlope(y) => {
                each!(sums, |f, p, sum| *sum = sum.where_positive(V::load(y.add(place(f, p)), between(p))))
            }
        }
        each!(sums, |f, p, sum| sum.store(tile.result.add(place(f, p)), between(p)));
    }
}

/// Picks the tiles compiled for this size.
///
/// # Safety
/// As [`tiles`].
#[inline(always)]
pub unsafe fn any_tiles<V: Vector, const S: usize>(panels: usize, entries: usize, count: usize, first: Tile) {
    // SAFETY: the caller's.
    unsafe {
        match (panels, entries) {
            (1, 1) => tiles::<V, S, 1, 1>(count, first),
            (1, 2) => tiles::<V, S, 1, 2>(count, first),
            (1, 3) => tiles::<V, S, 1, 3>(count, first),
            (1, 4) => tiles::<V, S, 1, 4>(count, first),
            (1, 5) => tiles::<V, S, 1, 5>(count, first),
            (1, 6) => tiles::<V, S, 1, 6>(count, first),
            (1, 7) => tiles::<V, S, 1, 7>(count, first),
            (1, 8) => tiles::<V, S, 1, 8>(count, first),
            (1, 9) => tiles::<V, S, 1, 9>(count, first),
            (1, 10) => tiles::<V, S, 1, 10>(count, first),
            (2, 1) => tiles::<V, S, 2, 1>(count, first),
            (2, 2) => tiles::<V, S, 2, 2>(count, first),
            (2, 3) => tiles::<V, S, 2, 3>(count, first),
            (2, 4) => tiles::<V, S, 2, 4>(count, first),
            (2, 5) => tiles::<V, S, 2, 5>(count, first),
            (2, 6) => tiles::<V, S, 2, 6>(count, first),
            (3, 1) => tiles::<V, S, 3, 1>(count, first),
            (3, 2) => tiles::<V, S, 3, 2>(count, first),
            (3, 3) => tiles::<V, S, 3, 3>(count, first),
            _ => unreachable!("no tile spans {panels} panels and {entries} entries"),
        }
    }
}

/// The same, with the larger tiles of 32 registers.
///
/// # Safety
/// As [`tiles`].
#[inline(always)]
pub unsafe fn any_large_tiles<V: Vector, const S: usize>(panels: usize, entries: usize, count: usize, first: Tile) {
    // SAFETY: the caller's.
    unsafe {
        match (panels, entries) {
            (2, 7) => tiles::<V, S, 2, 7>(count, first),
            (2, 8) => tiles::<V, S, 2, 8>(count, first),
            (2, 9) => tiles::<V, S, 2, 9>(count, first),
            (2, 10) => tiles::<V, S, 2, 10>(count, first),
            (2, 11) => tiles::<V, S, 2, 11>(count, first),
            (2, 12) => tiles::<V, S, 2, 12>(count, first),
            (3, 4) => tiles::<V, S, 3, 4>(count, first),
            (3, 5) => tiles::<V, S, 3, 5>(count, first),
            (3, 6) => tiles::<V, S, 3, 6>(count, first),
            (3, 7) => tiles::<V, S, 3, 7>(count, first),
            (3, 8) => tiles::<V, S, 3, 8>(count, first),
            (4, 1) => tiles::<V, S, 4, 1>(count, first),
            (4, 2) => tiles::<V, S, 4, 2>(count, first),
            (4, 3) => tiles::<V, S, 4, 3>(count, first),
            (4, 4) => tiles::<V, S, 4, 4>(count, first),
            (4, 5) => tiles::<V, S, 4, 5>(count, first),
            (4, 6) => tiles::<V, S, 4, 6>(count, first),
            _ => any_tiles::<V, S>(panels, entries, count, first),
        }
    }
}
