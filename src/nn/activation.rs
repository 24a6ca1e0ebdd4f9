//! Activations, entry by entry: what a product of a hidden layer ends with.

use super::kernel::Finish;
use super::lanes::Lanes;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What follows a hidden layer's linear map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Activation {
    /// Hyperbolic tangent (paper, Figure 3).
    Tanh,
    /// max(0, x) (paper, section 4.2).
    Relu,
}

impl Activation {
    /// y = activation(x), x being the product.
    pub fn forward(self) -> Finish<'static> {
        match self {
            Activation::Tanh => Finish::Tanh,
            Activation::Relu => Finish::Relu,
        }
    }

    /// d * activation'(x), d being the product and y the activation's output.
    pub fn backward(self, y: &[Lanes]) -> Finish<'_> {
        match self {
            Activation::Tanh => Finish::TanhSlope(y),
            Activation::Relu => Finish::ReluSlope(y),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nn::kernel::{Coefficients, Product, Start, product};

    /// `finish` of a number.
    fn finished(x: f32, finish: Finish) -> Lanes {
        let mut result = [Lanes::default()];
        let of = Product { x: &[Lanes::splat(x)], depth: 1, a: Coefficients::Matrix(&[1.0]), start: Start::Zero, finish };
        product(&mut result, 1, of);
        result[0]
    }

    #[test]
    fn derivatives_equal_finite_differences() {
        let h = 1e-3;
        for activation in [Activation::Tanh, Activation::Relu] {
            for x in [-2.0f32, -0.7, 0.3, 1.1] {
                let at = |x: f32| finished(x, activation.forward());
                let slope = finished(1.0, activation.backward(&[at(x)]));
                let numeric = (at(x + h) - at(x - h)) / (2.0 * h);
                assert!((slope - numeric).0[5].abs() < 1e-3, "{activation:?} at {x}");
            }
        }
    }
}
