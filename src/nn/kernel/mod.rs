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
mod choose;
mod entries;
mod fused;
mod on;
mod operation;
mod path;
mod portable;
mod tile;
mod tiles;
mod trial;
mod vector;

pub use choose::{choose, describe};
pub use operation::{Coefficients, Finish, Product, Start};

use super::lanes::{LANES, Lanes};

/// The product, into panels of `width` entries.
///
/// # Panics
/// When a length does not fit.
pub fn product(result: &mut [Lanes], width: usize, of: Product) {
    on::product(choose::best(), result, width, of);
}

/// Runs a loop over many numbers, each by itself, compiled for the registers of the path that runs. Nothing is fused, so that the results
/// have the same bits.
pub fn wide<R>(work: impl FnOnce() -> R) -> R {
    on::wide(choose::best(), work)
}

/// y <- tanh(y), in place.
pub fn tanh(y: &mut [Lanes]) {
    on::tanh(choose::best(), y);
}

/// Panels of `entries` entries turned round: to\[i\]\[r\] holds entries 8 i to 8 i + 7 of sample r. After the last entry comes a 1, which
/// is what a bias is the weight of, and then zeros.
///
/// # Panics
/// When a length does not fit.
pub fn transpose(to: &mut [Lanes], from: &[Lanes], entries: usize) {
    on::transpose(choose::best(), to, from, entries);
}

/// Eight rows side by side: panel\[i\] holds entry i of each.
///
/// # Panics
/// When a row is shorter than the panel.
pub fn interleave(panel: &mut [Lanes], rows: [&[f32]; LANES]) {
    on::interleave(choose::best(), panel, rows);
}

/// The eight rows of a panel, each by itself: the inverse of [`interleave`].
///
/// # Panics
/// When a row is shorter than the panel.
pub fn separate(rows: [&mut [f32]; LANES], panel: &[Lanes]) {
    on::separate(choose::best(), rows, panel);
}

#[cfg(test)]
mod tests;
