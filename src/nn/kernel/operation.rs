//! What a product is.

use crate::nn::lanes::Lanes;

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
