//! Eight rows side by side, and matrices made of them.
//!
//! A matrix of samples is cut into *panels* of eight rows; a panel holds entry after entry, each of them for its eight rows at once.
//! One instruction then works on eight samples, whatever the width of the matrix, and a row past the last is a lane left idle.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

/// Rows of a panel: what one AVX2 register holds.
pub const LANES: usize = 8;

/// One entry of eight rows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(32))]
pub struct Lanes(pub [f32; LANES]);

impl Lanes {
    /// The same number in all lanes.
    #[inline(always)]
    pub fn splat(value: f32) -> Self {
        Lanes([value; LANES])
    }

    /// A function of every lane.
    #[inline(always)]
    pub fn map(self, f: impl Fn(f32) -> f32) -> Self {
        Lanes(self.0.map(f))
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Lanes(std::array::from_fn(|i| f(self.0[i], other.0[i])))
    }

    /// Takes the lanes from `lane` on from `other`.
    #[inline(always)]
    pub fn take_from(&mut self, lane: usize, other: Self) {
        self.0.iter_mut().zip(other.0).skip(lane).for_each(|(to, from)| *to = from);
    }

    /// Sum of the lanes, always in the same order.
    #[inline]
    pub fn sum(self) -> f32 {
        let [a, b, c, d, e, f, g, h] = self.0;
        ((a + e) + (b + f)) + ((c + g) + (d + h))
    }
}

impl Add for Lanes {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl Sub for Lanes {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl Mul for Lanes {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

impl Mul<f32> for Lanes {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f32) -> Self {
        self.map(|a| a * factor)
    }
}

impl Div<f32> for Lanes {
    type Output = Self;
    #[inline(always)]
    fn div(self, divisor: f32) -> Self {
        self.map(|a| a / divisor)
    }
}

impl Neg for Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}

impl AddAssign for Lanes {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

/// Panels that hold `rows` rows.
pub fn panels_of(rows: usize) -> usize {
    rows.div_ceil(LANES)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_take_every_lane() {
        assert_eq!(Lanes([1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0]).sum(), 255.0);
    }
}
