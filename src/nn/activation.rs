//! Activations, element by element over a flat array, compiled twice: for AVX2 and for any processor. Both give the same bytes.

use serde::{Deserialize, Serialize};
use std::f32::consts::{LN_2, LOG2_E};

/// What follows a hidden layer's linear map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Activation {
    /// Hyperbolic tangent (paper, Figure 3).
    Tanh,
    /// max(0, x) (paper, section 4.2).
    Relu,
}

impl Activation {
    /// y <- activation(y), in place.
    pub fn forward(self, y: &mut [f32]) {
        match self {
            Activation::Tanh => dispatch(y),
            Activation::Relu => y.iter_mut().for_each(|v| *v = if *v > 0.0 { *v } else { *v * 0.0 }),
        }
    }

    /// d <- d * activation'(x), from the activation's output y.
    pub fn backward(self, d: &mut [f32], y: &[f32]) {
        let pairs = d.iter_mut().zip(y);
        match self {
            Activation::Tanh => pairs.for_each(|(d, y)| *d *= 1.0 - y * y),
            Activation::Relu => pairs.for_each(|(d, y)| *d = if *y > 0.0 { *d } else { 0.0 }),
        }
    }
}

fn dispatch(y: &mut [f32]) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        return unsafe { tanh_avx2(y) };
    }
    tanh_all(y);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn tanh_avx2(y: &mut [f32]) {
    tanh_all(y);
}

#[inline(always)]
fn tanh_all(y: &mut [f32]) {
    y.iter_mut().for_each(|v| *v = tanh(*v));
}

/// Beyond this tanh is 1 to the last bit of f32.
const SATURATED: f32 = 9.0;
/// 1.5 x 2^23: adding it rounds a small f32 to an integer, which then stands in the low bits.
const ROUND: f32 = 12_582_912.0;
/// Taylor coefficients of 2^f = exp(f ln 2); on |f| <= 1/2 the first left out is worth 1.2e-7.
const EXP2: [f32; 6] = [
    LN_2,
    LN_2 * LN_2 / 2.0,
    LN_2 * LN_2 * LN_2 / 6.0,
    LN_2 * LN_2 * LN_2 * LN_2 / 24.0,
    LN_2 * LN_2 * LN_2 * LN_2 * LN_2 / 120.0,
    LN_2 * LN_2 * LN_2 * LN_2 * LN_2 * LN_2 / 720.0,
];

/// tanh(x) = sign(x) (1 - t) / (1 + t), t = exp(-2 |x|); absolute error below 3e-7, and no branch, so that it vectorises.
#[inline(always)]
pub fn tanh(x: f32) -> f32 {
    let magnitude = if x.abs() > SATURATED { SATURATED } else { x.abs() };
    let exponent = magnitude * (-2.0 * LOG2_E);
    let rounded = exponent + ROUND;
    let f = exponent - (rounded - ROUND);
    let series = EXP2[3] + f * (EXP2[4] + f * EXP2[5]);
    let power = 1.0 + f * (EXP2[0] + f * (EXP2[1] + f * (EXP2[2] + f * series)));
    let t = f32::from_bits(power.to_bits().wrapping_add(rounded.to_bits() << 23));
    ((1.0 - t) / (1.0 + t)).copysign(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tanh_is_close_everywhere_and_the_same_on_every_path() {
        let xs: Vec<f32> = (-120_000..=120_000).map(|i| i as f32 * 1e-4).chain([0.0, -0.0, 1e-30, 50.0, -1e30]).collect();
        let mut y = xs.clone();
        Activation::Tanh.forward(&mut y);
        for (x, y) in xs.iter().zip(&y) {
            assert_eq!(y.to_bits(), tanh(*x).to_bits(), "paths differ at {x}");
            assert!((f64::from(*y) - f64::from(*x).tanh()).abs() < 3e-7, "tanh({x}) = {y}");
        }
        assert!(tanh(f32::NAN).is_nan());
    }

    #[test]
    fn derivatives_equal_finite_differences() {
        let h = 1e-3;
        for activation in [Activation::Tanh, Activation::Relu] {
            for x in [-2.0f32, -0.7, 0.3, 1.1] {
                let at = |x: f32| {
                    let mut y = [x];
                    activation.forward(&mut y);
                    y[0]
                };
                let mut d = [1.0];
                activation.backward(&mut d, &[at(x)]);
                assert!((d[0] - (at(x + h) - at(x - h)) / (2.0 * h)).abs() < 1e-3, "{activation:?} at {x}");
            }
        }
    }
}
