//! tanh, and samples turned into lanes.

use super::vector::{Arithmetic, Vector};
use crate::nn::lanes::{LANES, Lanes};

/// Where [`NUMERATOR`] and [`DENOMINATOR`] end: tanh is 1 there but for 2e-7.
const SATURATED: f32 = 8.0;
/// tanh(x) = x N(x^2) / D(x^2), fitted on \[0, 8\] by weighted least squares until the largest relative error stood still, at 6.5e-9.
const NUMERATOR: [f32; 5] = [0.999_999_994, 0.134_445_16, 3.571_619_7e-3, 2.189_499_9e-5, 1.523_083_9e-8];
const DENOMINATOR: [f32; 5] = [1.0, 0.467_778_44, 2.616_452_6e-2, 3.411_326_6e-4, 8.522_629_3e-7];

/// tanh(x).
///
/// # Safety
/// The processor has T's instructions; so below.
#[inline(always)]
pub unsafe fn tanh<T: Arithmetic>(x: T) -> T {
    // SAFETY: the caller's.
    unsafe {
        let x = x.within(SATURATED);
        let square = x.times(x);
        x.times(polynomial(square, NUMERATOR)).over(polynomial(square, DENOMINATOR))
    }
}

#[inline(always)]
unsafe fn polynomial<T: Arithmetic>(x: T, coefficients: [f32; 5]) -> T {
    // SAFETY: the caller's.
    unsafe {
        let mut sum = T::splat(coefficients[4]);
        for c in coefficients[..4].iter().rev() {
            sum = sum.times_plus(x, T::splat(*c));
        }
        sum
    }
}

/// d (1 - y^2).
#[inline(always)]
pub unsafe fn tanh_slope<T: Arithmetic>(d: T, y: T) -> T {
    // SAFETY: the caller's.
    unsafe { d.times(y).times(T::splat(-1.0)).times_plus(y, d) }
}

#[inline(always)]
pub unsafe fn tanh_all<T: Vector>(y: &mut [Lanes]) {
    for at in y {
        // SAFETY: `at` is borrowed; the rest is the caller's.
        unsafe { tanh(T::load(at)).store(at) }
    }
}

/// Eight floats from each of eight places turned round: element i of vector r becomes element r of vector i. The vectors go by value: a
/// borrowed array of them would be copied through memory.
///
/// # Safety
/// Eight floats lie at each address, and the processor has T's instructions.
#[inline(always)]
unsafe fn turn<T: Vector>(to: [*mut f32; LANES], from: [*const f32; LANES]) {
    // SAFETY: the caller's.
    unsafe {
        let turned = T::transposed(from.map(|row| T::load_row(row)));
        to.into_iter().zip(turned).for_each(|(to, row)| row.store_row(to));
    }
}

#[inline(always)]
pub unsafe fn transpose<T: Vector>(to: &mut [Lanes], from: &[Lanes], entries: usize) {
    let samples = from.len() / entries * LANES;
    for (p, panel) in from.chunks_exact(entries).enumerate() {
        let (whole, rest) = panel.as_chunks::<LANES>();
        let mut last = [Lanes::default(); LANES];
        last[..rest.len()].copy_from_slice(rest);
        last[rest.len()] = Lanes::splat(1.0);
        for (square, to) in whole.iter().chain([&last]).zip(to.chunks_exact_mut(samples)) {
            let (to, square) = (to[p * LANES..(p + 1) * LANES].as_mut_ptr(), square.as_ptr());
            // SAFETY: all are borrowed; the rest is the caller's.
            unsafe {
                turn::<T>(std::array::from_fn(|k| to.add(k).cast()), std::array::from_fn(|k| square.add(k).cast()));
            }
        }
    }
}

/// # Safety
/// The rows have the panel's length, and the processor has T's instructions.
#[inline(always)]
pub unsafe fn interleave<T: Vector>(panel: &mut [Lanes], rows: [&[f32]; LANES]) {
    let Some(last) = panel.len().checked_sub(LANES) else {
        let entry = |i: usize| Lanes(std::array::from_fn(|r| rows[r][i]));
        return panel.iter_mut().enumerate().for_each(|(i, slot)| *slot = entry(i));
    };
    // eight entries at a time; the last eight overlap those before
    for from in (0..last).step_by(LANES).chain([last]) {
        // SAFETY: entries from..from + 8 lie in every row, as from <= last; the rest is the caller's.
        unsafe {
            let to = panel[from..from + LANES].as_mut_ptr();
            turn::<T>(std::array::from_fn(|k| to.add(k).cast()), rows.map(|row| row.as_ptr().add(from)));
        }
    }
}

/// # Safety
/// As [`interleave`].
#[inline(always)]
pub unsafe fn separate<T: Vector>(rows: [&mut [f32]; LANES], panel: &[Lanes]) {
    let Some(last) = panel.len().checked_sub(LANES) else {
        return rows
            .into_iter()
            .enumerate()
            .for_each(|(r, row)| row.iter_mut().zip(panel).for_each(|(v, entry)| *v = entry.0[r]));
    };
    let rows = rows.map(|row| row.as_mut_ptr());
    for from in (0..last).step_by(LANES).chain([last]) {
        // SAFETY: as above.
        unsafe {
            let square = panel[from..from + LANES].as_ptr();
            turn::<T>(rows.map(|row| row.add(from)), std::array::from_fn(|k| square.add(k).cast()));
        }
    }
}
