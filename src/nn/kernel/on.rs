//! The operations on a path of one's choice, which the processor must have.

use super::operation::{Coefficients, Finish, Product, Start};
use super::path::Path;
use super::portable::Portable;
#[cfg(target_arch = "x86_64")]
use super::{avx2, avx512, avx512vl};
use super::{entries, tiles};
use crate::nn::lanes::{LANES, Lanes};

/// As [`super::product`].
pub fn product(path: Path, result: &mut [Lanes], width: usize, of: Product) {
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
            Path::Portable => tiles::product::<Portable>(result, width, &of),
        }
    }
}

/// As [`super::wide`].
pub fn wide<R>(path: Path, work: impl FnOnce() -> R) -> R {
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

/// As [`super::tanh`].
pub fn tanh(path: Path, y: &mut [Lanes]) {
    // SAFETY: `path` is one that this processor has.
    unsafe {
        match path {
            #[cfg(target_arch = "x86_64")]
            Path::Avx512 | Path::Avx512Vl | Path::Avx2 => avx2::tanh(y),
            Path::Portable => entries::tanh_all::<Lanes>(y),
        }
    }
}

/// As [`super::transpose`].
pub fn transpose(path: Path, to: &mut [Lanes], from: &[Lanes], entries: usize) {
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

/// As [`super::interleave`].
pub fn interleave(path: Path, panel: &mut [Lanes], rows: [&[f32]; LANES]) {
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

/// As [`super::separate`].
pub fn separate(path: Path, rows: [&mut [f32]; LANES], panel: &[Lanes]) {
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
