//! The arithmetic that a network spends its time in: one kernel for all matrix products, and tanh. Each is written once over a vector
//! of eight floats and compiled twice, for AVX2 with FMA and for any processor; which one runs is found out at run time. Results
//! differ in their last bits between the two, never between runs on one processor. All `unsafe` code of the library stands here.

use super::lanes::{LANES, Lanes};

/// The coefficients a of a product: entry `f` of the result is the sum over `k` of a(k, f) times the sample's entry `k`.
#[derive(Clone, Copy)]
pub enum Coefficients<'a> {
    /// A row-major matrix: a(k, f) is entry `f` of row `k`.
    Matrix(&'a [f32]),
    /// Samples in panels: a(k, f) is entry `f` of sample `k`.
    Samples(&'a [Lanes]),
}

/// What the sums of a product begin with.
#[derive(Clone, Copy)]
pub enum Start<'a> {
    /// Nothing.
    Zero,
    /// What the result holds.
    Result,
    /// A number for each entry.
    Bias(&'a [f32]),
}

/// Panels of results and panels that a register tile spans, and the most entries it can then span: 12 sums of 8 lanes leave four of 16
/// registers for operands and hide the latency of FMA (at least 8 are needed). A single panel is bound by loads, whatever it spans.
const TILE_PANELS: usize = 2;
const TILE_ENTRIES: [usize; TILE_PANELS + 1] = [0, 10, 6];

/// result\[p\]\[f\] = start + sum over k of a(k, f) x\[p\]\[k\], for panels `x` of `depth` entries and panels `result` of `width`.
///
/// # Panics
/// When a length does not fit.
pub fn product(result: &mut [Lanes], width: usize, x: &[Lanes], depth: usize, a: Coefficients, start: Start) {
    product_on(Path::best(), result, width, x, depth, a, start);
}

fn product_on(path: Path, result: &mut [Lanes], width: usize, x: &[Lanes], depth: usize, a: Coefficients, start: Start) {
    let panels = x.len() / depth;
    assert_eq!((x.len(), result.len()), (panels * depth, panels * width), "panels of {depth} entries give panels of {width}");
    match a {
        Coefficients::Matrix(values) => assert_eq!(values.len(), depth * width, "a matrix is {depth} x {width}"),
        Coefficients::Samples(samples) => {
            assert_eq!(samples.len() * LANES, depth * width, "{depth} samples of {width} entries fill their panels");
        }
    }
    if let Start::Bias(bias) = start {
        assert_eq!(bias.len(), width, "one number an entry");
    }
    // SAFETY: the lengths were checked, and `path` is one that this processor has.
    unsafe {
        match path {
            #[cfg(target_arch = "x86_64")]
            Path::Avx2 => avx2::tiles(result, width, x, depth, a, start),
            Path::Portable => tiles::<Lanes>(result, width, x, depth, a, start),
        }
    }
}

/// The product, tile by tile.
///
/// # Safety
/// The lengths fit as [`product`] says, and the processor has T's instructions.
#[inline(always)]
unsafe fn tiles<T: Vector>(result: &mut [Lanes], width: usize, x: &[Lanes], depth: usize, a: Coefficients, start: Start) {
    for p in parts(x.len() / depth, TILE_PANELS) {
        for f in parts(width, TILE_ENTRIES[p.len()]) {
            // SAFETY: the tile reads entries 0..depth of panels p of x and the biases f, and writes entries f of panels p of the result;
            // it reads a(k, f) for k < depth and f < width, in a matrix that is number k * width + f < depth * width, among samples
            // number (k / 8 * width + f) * 8 + k % 8 < depth * width. `result` is borrowed mutably: nothing else aliases it.
            unsafe {
                let (result, x) = (result.as_mut_ptr().add(p.start * width + f.start), x.as_ptr().add(p.start * depth));
                let start = match start {
                    Start::Zero => TileStart::Zero,
                    Start::Result => TileStart::Result,
                    Start::Bias(bias) => TileStart::Bias(bias.as_ptr().add(f.start)),
                };
                match a {
                    Coefficients::Matrix(values) => {
                        let a = values.as_ptr().add(f.start);
                        let tile = Tile {
                            result,
                            width,
                            x,
                            depth,
                            a,
                            blocks: 1,
                            between_blocks: 0,
                            inner: depth,
                            between_k: width,
                            start,
                        };
                        T::tile::<1>(p.len(), f.len(), &tile);
                    }
                    Coefficients::Samples(samples) => {
                        let (a, blocks) = (samples.as_ptr().add(f.start).cast(), depth / LANES);
                        let between_blocks = LANES * width;
                        let tile = Tile { result, width, x, depth, a, blocks, between_blocks, inner: LANES, between_k: 1, start };
                        T::tile::<LANES>(p.len(), f.len(), &tile);
                    }
                }
            }
        }
    }
}

/// 0..n in the fewest parts of at most `most`, as even as can be.
#[inline(always)]
fn parts(n: usize, most: usize) -> impl Iterator<Item = std::ops::Range<usize>> {
    let count = n.div_ceil(most);
    let (least, longer) = (n / count.max(1), n % count.max(1));
    let mut start = 0;
    (0..count).map(move |i| {
        let end = start + least + usize::from(i < longer);
        std::mem::replace(&mut start, end)..end
    })
}

/// y <- tanh(y), in place.
pub fn tanh(y: &mut [Lanes]) {
    tanh_on(Path::best(), y);
}

fn tanh_on(path: Path, y: &mut [Lanes]) {
    // SAFETY: `path` is one that this processor has.
    unsafe {
        match path {
            #[cfg(target_arch = "x86_64")]
            Path::Avx2 => avx2::tanh(y),
            Path::Portable => tanh_all::<Lanes>(y),
        }
    }
}

/// d <- d (1 - y^2): the gradient comes back through y = tanh(x).
pub fn tanh_backward(d: &mut [Lanes], y: &[Lanes]) {
    tanh_backward_on(Path::best(), d, y);
}

fn tanh_backward_on(path: Path, d: &mut [Lanes], y: &[Lanes]) {
    // SAFETY: as above.
    unsafe {
        match path {
            #[cfg(target_arch = "x86_64")]
            Path::Avx2 => avx2::tanh_backward(d, y),
            Path::Portable => tanh_backward_all::<Lanes>(d, y),
        }
    }
}

/// Panels of `entries` entries turned round: to\[i\]\[r\] holds entries 8 i to 8 i + 7 of sample r. After the last entry comes a 1, which
/// is what a bias is the weight of, and then zeros.
///
/// # Panics
/// When a length does not fit.
pub fn transpose(to: &mut [Lanes], from: &[Lanes], entries: usize) {
    transpose_on(Path::best(), to, from, entries);
}

fn transpose_on(path: Path, to: &mut [Lanes], from: &[Lanes], entries: usize) {
    let panels = from.len() / entries;
    assert_eq!(
        (from.len(), to.len()),
        (panels * entries, panels * LANES * (entries + 1).div_ceil(LANES)),
        "panels of {entries} entries"
    );
    // SAFETY: as above.
    unsafe {
        match path {
            #[cfg(target_arch = "x86_64")]
            Path::Avx2 => avx2::transpose(to, from, entries),
            Path::Portable => transpose_all::<Lanes>(to, from, entries),
        }
    }
}

/// Asks the processor to bring these into its cache while it works on something else; without effect on any result.
pub fn prefetch(soon: &[Lanes]) {
    #[cfg(target_arch = "x86_64")]
    for line in soon.chunks(CACHE_LINE / size_of::<Lanes>()) {
        // SAFETY: SSE belongs to x86-64, and a prefetch reads nothing.
        unsafe { std::arch::x86_64::_mm_prefetch::<{ std::arch::x86_64::_MM_HINT_T0 }>(line.as_ptr().cast()) }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = soon;
}

/// Bytes that a processor fetches at once.
#[cfg(target_arch = "x86_64")]
const CACHE_LINE: usize = 64;

/// Which compilation runs.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Path {
    #[cfg(target_arch = "x86_64")]
    Avx2,
    Portable,
}

impl Path {
    fn best() -> Path {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
            return Path::Avx2;
        }
        Path::Portable
    }
}

/// The addresses of one register tile.
struct Tile {
    result: *mut Lanes,
    width: usize,
    x: *const Lanes,
    depth: usize,
    a: *const f32,
    /// Coefficients lie in `blocks` of `inner`; distances in floats.
    blocks: usize,
    between_blocks: usize,
    inner: usize,
    between_k: usize,
    start: TileStart,
}

#[derive(Clone, Copy)]
enum TileStart {
    Zero,
    Result,
    Bias(*const f32),
}

/// A vector of eight floats.
trait Vector: Copy {
    unsafe fn load(from: *const Lanes) -> Self;
    unsafe fn store(self, to: *mut Lanes);
    unsafe fn splat(value: f32) -> Self;
    /// self + other.
    unsafe fn add(self, other: Self) -> Self;
    /// self * factor.
    unsafe fn times(self, factor: Self) -> Self;
    /// self / divisor.
    unsafe fn over(self, divisor: Self) -> Self;
    /// self * factor + summand.
    unsafe fn times_plus(self, factor: Self, summand: Self) -> Self;
    /// The nearest number to self between -limit and limit; NaN stays.
    unsafe fn within(self, limit: f32) -> Self;
    /// Element i of vector r becomes element r of vector i.
    unsafe fn transposed(square: [Self; LANES]) -> [Self; LANES];
    /// [`any_tile`], compiled by itself: merged into its caller the compiler would know `inner` and unroll that loop, to its harm.
    unsafe fn tile<const S: usize>(panels: usize, entries: usize, at: &Tile);
}

impl Vector for Lanes {
    #[inline(always)]
    unsafe fn load(from: *const Lanes) -> Self {
        // SAFETY: the caller's.
        unsafe { *from }
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut Lanes) {
        // SAFETY: the caller's.
        unsafe { *to = self }
    }
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
        self * factor + summand
    }
    #[inline(always)]
    unsafe fn within(self, limit: f32) -> Self {
        self.map(|v| if v > limit { limit } else { v }).map(|v| if v < -limit { -limit } else { v })
    }
    #[inline(always)]
    unsafe fn transposed(square: [Self; LANES]) -> [Self; LANES] {
        std::array::from_fn(|r| Lanes(std::array::from_fn(|i| square[i].0[r])))
    }
    #[inline(never)]
    unsafe fn tile<const S: usize>(panels: usize, entries: usize, at: &Tile) {
        // SAFETY: the caller's.
        unsafe { any_tile::<Self, S>(panels, entries, at) }
    }
}

/// A tile of P panels and F entries, a(k, f) and a(k, f + 1) being S floats apart.
///
/// # Safety
/// Every address lies within its array, and the processor has T's instructions.
#[inline(always)]
unsafe fn tile<T: Vector, const S: usize, const P: usize, const F: usize>(tile: &Tile) {
    // SAFETY: the caller's.
    unsafe {
        let mut sums = [[T::splat(0.0); P]; F];
        let (mut x, mut block) = (tile.x, tile.a);
        for _ in 0..tile.blocks {
            let mut a = block;
            for _ in 0..tile.inner {
                let samples: [T; P] = std::array::from_fn(|p| T::load(x.wrapping_add(p * tile.depth)));
                for (f, sums) in sums.iter_mut().enumerate() {
                    let a = T::splat(*a.add(f * S));
                    for (sum, sample) in sums.iter_mut().zip(samples) {
                        *sum = sample.times_plus(a, *sum);
                    }
                }
                a = a.wrapping_add(tile.between_k);
                x = x.wrapping_add(1);
            }
            block = block.wrapping_add(tile.between_blocks);
        }
        for (f, sums) in sums.into_iter().enumerate() {
            for (p, sum) in sums.into_iter().enumerate() {
                let to = tile.result.add(p * tile.width + f);
                match tile.start {
                    TileStart::Zero => sum.store(to),
                    TileStart::Result => sum.add(T::load(to)).store(to),
                    TileStart::Bias(bias) => sum.add(T::splat(*bias.add(f))).store(to),
                }
            }
        }
    }
}

/// Picks the tile compiled for this size.
///
/// # Safety
/// As [`tile`].
#[inline(always)]
unsafe fn any_tile<T: Vector, const S: usize>(panels: usize, entries: usize, at: &Tile) {
    // SAFETY: the caller's.
    unsafe {
        match (panels, entries) {
            (1, 1) => tile::<T, S, 1, 1>(at),
            (1, 2) => tile::<T, S, 1, 2>(at),
            (1, 3) => tile::<T, S, 1, 3>(at),
            (1, 4) => tile::<T, S, 1, 4>(at),
            (1, 5) => tile::<T, S, 1, 5>(at),
            (1, 6) => tile::<T, S, 1, 6>(at),
            (1, 7) => tile::<T, S, 1, 7>(at),
            (1, 8) => tile::<T, S, 1, 8>(at),
            (1, 9) => tile::<T, S, 1, 9>(at),
            (1, 10) => tile::<T, S, 1, 10>(at),
            (2, 1) => tile::<T, S, 2, 1>(at),
            (2, 2) => tile::<T, S, 2, 2>(at),
            (2, 3) => tile::<T, S, 2, 3>(at),
            (2, 4) => tile::<T, S, 2, 4>(at),
            (2, 5) => tile::<T, S, 2, 5>(at),
            (2, 6) => tile::<T, S, 2, 6>(at),
            _ => unreachable!("tiles span 1 or 2 panels, and no more entries than registers hold"),
        }
    }
}

/// Where [`NUMERATOR`] and [`DENOMINATOR`] end: tanh is 1 there but for 2e-7.
const SATURATED: f32 = 8.0;
/// tanh(x) = x N(x^2) / D(x^2), fitted on \[0, 8\] by weighted least squares until the largest relative error stood still, at 6.5e-9.
const NUMERATOR: [f32; 5] = [0.999_999_994, 0.134_445_16, 3.571_619_7e-3, 2.189_499_9e-5, 1.523_083_9e-8];
const DENOMINATOR: [f32; 5] = [1.0, 0.467_778_44, 2.616_452_6e-2, 3.411_326_6e-4, 8.522_629_3e-7];

/// # Safety
/// The processor has T's instructions; so below.
#[inline(always)]
unsafe fn tanh_all<T: Vector>(y: &mut [Lanes]) {
    for at in y {
        // SAFETY: `at` is borrowed; the rest is the caller's.
        unsafe {
            let x = T::load(at).within(SATURATED);
            let square = x.times(x);
            x.times(polynomial(square, NUMERATOR)).over(polynomial(square, DENOMINATOR)).store(at);
        }
    }
}

#[inline(always)]
unsafe fn polynomial<T: Vector>(x: T, coefficients: [f32; 5]) -> T {
    // SAFETY: the caller's.
    unsafe {
        let mut sum = T::splat(coefficients[4]);
        for c in coefficients[..4].iter().rev() {
            sum = sum.times_plus(x, T::splat(*c));
        }
        sum
    }
}

#[inline(always)]
unsafe fn tanh_backward_all<T: Vector>(d: &mut [Lanes], y: &[Lanes]) {
    for (d, y) in d.iter_mut().zip(y) {
        // SAFETY: both are borrowed; the rest is the caller's.
        unsafe {
            let (slope, y) = (T::load(d), T::load(y));
            slope.times(y).times(T::splat(-1.0)).times_plus(y, slope).store(d);
        }
    }
}

#[inline(always)]
unsafe fn transpose_all<T: Vector>(to: &mut [Lanes], from: &[Lanes], entries: usize) {
    let samples = from.len() / entries * LANES;
    for (p, panel) in from.chunks_exact(entries).enumerate() {
        for (i, to) in to.chunks_exact_mut(samples).enumerate() {
            // SAFETY: all are borrowed; the rest is the caller's.
            unsafe {
                let part = &panel[i * LANES..entries.min((i + 1) * LANES)];
                let load = |k: usize| part.get(k).map_or(T::splat(if k == part.len() { 1.0 } else { 0.0 }), |at| T::load(at));
                let turned = T::transposed(std::array::from_fn(load));
                to[p * LANES..].iter_mut().zip(turned).for_each(|(to, v)| v.store(to));
            }
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use super::{Coefficients, LANES, Lanes, Start, Tile, Vector};
    use std::arch::x86_64::*;

    impl Vector for __m256 {
        #[inline(always)]
        unsafe fn load(from: *const Lanes) -> Self {
            // SAFETY: the caller's; Lanes are aligned to 32 bytes.
            unsafe { _mm256_load_ps(from.cast()) }
        }
        #[inline(always)]
        unsafe fn store(self, to: *mut Lanes) {
            // SAFETY: as above.
            unsafe { _mm256_store_ps(to.cast(), self) }
        }
        #[inline(always)]
        unsafe fn splat(value: f32) -> Self {
            // SAFETY: the processor has AVX2, here and below.
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
        unsafe fn tile<const S: usize>(panels: usize, entries: usize, at: &Tile) {
            // SAFETY: the caller's.
            unsafe { any_tile::<S>(panels, entries, at) }
        }
    }

    #[target_feature(enable = "avx2,fma")]
    #[inline(never)]
    unsafe fn any_tile<const S: usize>(panels: usize, entries: usize, at: &Tile) {
        // SAFETY: the caller's.
        unsafe { super::any_tile::<__m256, S>(panels, entries, at) }
    }

    /// # Safety
    /// As [`super::tiles`].
    #[target_feature(enable = "avx2,fma")]
    pub unsafe fn tiles(result: &mut [Lanes], width: usize, x: &[Lanes], depth: usize, a: Coefficients, start: Start) {
        // SAFETY: the caller's.
        unsafe { super::tiles::<__m256>(result, width, x, depth, a, start) }
    }

    #[target_feature(enable = "avx2,fma")]
    pub fn tanh(y: &mut [Lanes]) {
        // SAFETY: this function has T's instructions; so below.
        unsafe { super::tanh_all::<__m256>(y) }
    }

    #[target_feature(enable = "avx2,fma")]
    pub fn tanh_backward(d: &mut [Lanes], y: &[Lanes]) {
        // SAFETY: as above.
        unsafe { super::tanh_backward_all::<__m256>(d, y) }
    }

    #[target_feature(enable = "avx2,fma")]
    pub fn transpose(to: &mut [Lanes], from: &[Lanes], entries: usize) {
        // SAFETY: as above.
        unsafe { super::transpose_all::<__m256>(to, from, entries) }
    }
}

#[cfg(test)]
mod tests;
