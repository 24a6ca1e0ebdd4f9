//! Activations, entry by entry.

use super::kernel;
use super::lanes::Lanes;
use serde::{Deserialize, Serialize};

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
    pub fn forward(self, y: &mut [Lanes]) {
        match self {
            Activation::Tanh => kernel::tanh(y),
            Activation::Relu => y.iter_mut().for_each(|y| *y = y.map(|v| if v > 0.0 { v } else { v * 0.0 })),
        }
    }

    /// d <- d * activation'(x), from the activation's output y.
    pub fn backward(self, d: &mut [Lanes], y: &[Lanes]) {
        match self {
            Activation::Tanh => kernel::tanh_backward(d, y),
            Activation::Relu => d.iter_mut().zip(y).for_each(|(d, y)| *d = *d * y.map(|y| if y > 0.0 { 1.0 } else { 0.0 })),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_equal_finite_differences() {
        let h = 1e-3;
        for activation in [Activation::Tanh, Activation::Relu] {
            for x in [-2.0f32, -0.7, 0.3, 1.1] {
                let at = |x: f32| {
                    let mut y = [Lanes::splat(x)];
                    activation.forward(&mut y);
                    y[0]
                };
                let mut d = [Lanes::splat(1.0)];
                activation.backward(&mut d, &[at(x)]);
                let numeric = (at(x + h) - at(x - h)) / (2.0 * h);
                assert!((d[0] - numeric).0[5].abs() < 1e-3, "{activation:?} at {x}");
            }
        }
    }
}
