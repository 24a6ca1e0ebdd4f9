//! The arithmetic that a network spends its time in: one kernel for all matrix products, which ends with the activation, and what moves
//! samples into lanes. Each is written once over a `vector` and compiled for AVX-512 (with registers of sixteen and of eight floats), for
//! AVX2 with FMA and for any processor; which one runs is found out at run time ([`choose`]). All give the same bits: where the processor
//! has no fused multiply-add, `fused` does it in software, many times slower. All `unsafe` code of the library stands in this directory.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
#[cfg(target_arch = "x86_64")]
mod avx512vl;
mod entries;
mod fused;
mod path;
mod tiles;
mod trial;
mod vector;

use super::lanes::{LANES, Lanes};
use path::Path;

pub use path::{choose, describe};

/// A product: result\[p\]\[f\] = finish(start + sum over k of a(k, f) x\[p\]\[k\]).
#[derive(Clone, Copy)]
pub struct Product<'a> {
    /// Panels of `depth` entries.
    pub x: &'a [Lanes],
    /// The number of summands.
    pub depth: usize,
    /// The coefficients.
    pub a: Coefficients<'a>,
    /// What the sums begin with.
    pub start: Start<'a>,
    /// What is made of the sums.
    pub finish: Finish<'a>,
}

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

/// What becomes of a sum s before it is stored; y is an activation's output, laid out as the result.
#[derive(Clone, Copy)]
pub enum Finish<'a> {
    /// s.
    Nothing,
    /// tanh(s).
    Tanh,
    /// max(0, s).
    Relu,
    /// s (1 - y^2): the gradient s comes back through y = tanh(x).
    TanhSlope(&'a [Lanes]),
    /// s where y > 0, else 0: the gradient s comes back through y = max(0, x).
    ReluSlope(&'a [Lanes]),
}

/// The product, into panels of `width` entries.
///
/// # Panics
/// When a length does not fit.
pub fn product(result: &mut [Lanes], width: usize, of: Product) {
    product_on(Path::best(), result, width, of);
}

fn product_on(path: Path, result: &mut [Lanes], width: usize, of: Product) {
    let (panels, depth) = (of.x.len() / of.depth, of.depth);
    assert_eq!((of.x.len(), result.len()), (panels * depth, panels * width), "panels of {depth} entries give panels of {width}");
    match of.a {
        Coefficients::Matrix(values) => assert_eq!(values.len(), depth * width, "a matrix is {depth} x {width}"),
        Coefficients::Samples(samples) => {
            assert_eq!(samples.len() * LANES, depth * width, "{depth} samples of {width} entries fill their panels");
        }
    }
    if let Start::Bias(bias) = of.start {
        assert_eq!(bias.len(), width, "one number an entry");
    }
    if let Finish::TanhSlope(y) | Finish::ReluSlope(y) = of.finish {
        assert_eq!(y.len(), result.len(), "one output of the activation an entry of the result");
    }
    // SAFETY: the lengths were checked, and `path` is one that this processor has.
    unsafe {
        match path {
            #[cfg(target_arch = "x86_64")]
            Path::Avx512 => avx512::product(result, width, &of),
            #[cfg(target_arch = "x86_64")]
            Path::Avx512Vl => avx512vl::product(result, width, &of),
            #[cfg(target_arch = "x86_64")]
            Path::Avx2 => avx2::product(result, width, &of),
            Path::Portable => tiles::product::<vector::Portable>(result, width, &of),
        }
    }
}

/// Runs a loop over many numbers, each by itself, compiled for the registers of the path that runs. Nothing is fused, so that the results
/// have the same bits.
pub fn wide<R>(work: impl FnOnce() -> R) -> R {
    wide_on(Path::best(), work)
}

fn wide_on<R>(path: Path, work: impl FnOnce() -> R) -> R {
    // SAFETY: `path` is one that this processor has.
    unsafe {
        match path {
            #[cfg(target_arch = "x86_64")]
            Path::Avx512 => avx512::wide(work),
            #[cfg(target_arch = "x86_64")]
            Path::Avx512Vl | Path::Avx2 => avx2::wide(work),
            Path::Portable => work(),
        }
    }
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
            Path::Avx512 | Path::Avx512Vl | Path::Avx2 => avx2::tanh(y),
            Path::Portable => entries::tanh_all::<Lanes>(y),
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
            Path::Avx512 | Path::Avx512Vl | Path::Avx2 => avx2::transpose(to, from, entries),
            Path::Portable => entries::transpose::<Lanes>(to, from, entries),
        }
    }
}

/// Eight rows side by side: panel\[i\] holds entry i of each.
///
/// # Panics
/// When a row is shorter than the panel.
pub fn interleave(panel: &mut [Lanes], rows: [&[f32]; LANES]) {
    interleave_on(Path::best(), panel, rows);
}

fn interleave_on(path: Path, panel: &mut [Lanes], rows: [&[f32]; LANES]) {
    let rows = rows.map(|row| &row[..panel.len()]);
    // SAFETY: the rows have the panel's length, and `path` is one that this processor has.
    unsafe {
        match path {
            #[cfg(target_arch = "x86_64")]
            Path::Avx512 | Path::Avx512Vl | Path::Avx2 => avx2::interleave(panel, rows),
            Path::Portable => entries::interleave::<Lanes>(panel, rows),
        }
    }
}

/// The eight rows of a panel, each by itself: the inverse of [`interleave`].
///
/// # Panics
/// When a row is shorter than the panel.
pub fn separate(rows: [&mut [f32]; LANES], panel: &[Lanes]) {
    separate_on(Path::best(), rows, panel);
}

fn separate_on(path: Path, rows: [&mut [f32]; LANES], panel: &[Lanes]) {
    let rows = rows.map(|row| &mut row[..panel.len()]);
    // SAFETY: as above.
    unsafe {
        match path {
            #[cfg(target_arch = "x86_64")]
            Path::Avx512 | Path::Avx512Vl | Path::Avx2 => avx2::separate(rows, panel),
            Path::Portable => entries::separate::<Lanes>(rows, panel),
        }
    }
}

#[cfg(test)]
mod tests;
