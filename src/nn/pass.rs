//! The workspace of forward and backward.

use super::Mlp;
use super::kernel::{Coefficients, Start, product, transpose};
use super::lanes::{LANES, Lanes, Panels};

/// Panels of samples whose weight gradient is summed in one go: 16 of 100 entries, transposed, take 50 kB, a tenth of a core's cache.
pub(super) const GRADIENT_PANELS: usize = 16;

/// Activations and their gradients: the workspace of one thread. Lanes that hold no row must hold finite inputs and zeros in `d_output`.
#[derive(Clone, Debug, Default)]
pub struct Pass {
    /// Inputs, widths\[0\] entries.
    pub input: Panels,
    /// Outputs, widths\[last\] entries.
    pub output: Panels,
    /// Gradient of the loss with respect to the outputs, to be set before [`Mlp::backward`].
    pub d_output: Panels,
    /// Gradient with respect to the inputs, set by [`Mlp::backward_input`].
    pub d_input: Panels,
    pub(super) hidden: Vec<Panels>,
    pub(super) d_hidden: Vec<Panels>,
    pub(super) sums: WeightSums,
}

impl Pass {
    /// A workspace for `panels` panels of `mlp`.
    pub fn new(mlp: &Mlp, panels: usize) -> Self {
        let mut pass = Pass::default();
        pass.reserve(mlp, panels);
        pass
    }

    /// Makes room for `panels` panels; keeps what is there and never shrinks.
    pub fn reserve(&mut self, mlp: &Mlp, panels: usize) {
        let hidden = &mlp.widths()[1..mlp.layers()];
        self.hidden.resize_with(hidden.len(), Panels::default);
        self.d_hidden.resize_with(hidden.len(), Panels::default);
        for (i, width) in hidden.iter().enumerate() {
            self.hidden[i].reserve(*width, panels);
            self.d_hidden[i].reserve(*width, panels);
        }
        self.input.reserve(mlp.inputs(), panels);
        self.d_input.reserve(mlp.inputs(), panels);
        self.output.reserve(mlp.outputs(), panels);
        self.d_output.reserve(mlp.outputs(), panels);
    }
}

/// A layer's weight gradient while it is summed: lanes run over the layer's inputs, so that it is a product like the others.
#[derive(Clone, Debug, Default)]
pub(super) struct WeightSums {
    /// Samples with inputs for lanes: \[inputs / 8\]\[samples\].
    x: Vec<Lanes>,
    /// Sums so far: \[inputs / 8\]\[outputs\].
    d_weights: Vec<Lanes>,
    /// Sums of dy, one lane a row of its panel.
    d_bias: Vec<Lanes>,
}

impl WeightSums {
    /// Starts the sums of a layer.
    pub fn begin(&mut self, inputs: usize, outputs: usize) {
        self.d_weights.clear();
        self.d_weights.resize(inputs.div_ceil(LANES) * outputs, Lanes::default());
        self.d_bias.clear();
        self.d_bias.resize(outputs, Lanes::default());
    }

    /// Adds x^T dy to the sums, from panels of `inputs` and of `outputs` entries.
    pub fn add(&mut self, x: &[Lanes], inputs: usize, dy: &[Lanes], outputs: usize) {
        let samples = x.len() / inputs * LANES;
        self.x.resize(inputs.div_ceil(LANES) * samples, Lanes::default());
        transpose(&mut self.x, x, inputs);
        product(&mut self.d_weights, outputs, &self.x, samples, Coefficients::Samples(dy), Start::Result);
        dy.chunks_exact(outputs).for_each(|dy| self.d_bias.iter_mut().zip(dy).for_each(|(sum, d)| *sum += *d));
    }

    /// Adds the sums to a layer's part of the gradient, weights inputs x outputs.
    pub fn add_to(&self, d_weights: &mut [f32], d_bias: &mut [f32]) {
        let outputs = d_bias.len();
        for (i, sums) in d_weights.chunks_mut(LANES * outputs).zip(self.d_weights.chunks_exact(outputs)) {
            for (l, row) in i.chunks_exact_mut(outputs).enumerate() {
                row.iter_mut().zip(sums).for_each(|(d, sum)| *d += sum.0[l]);
            }
        }
        d_bias.iter_mut().zip(&self.d_bias).for_each(|(d, sum)| *d += sum.sum());
    }
}
