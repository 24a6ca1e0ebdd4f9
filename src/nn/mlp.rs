//! A multilayer perceptron with a linear head; each backward stands under its forward.

use super::Pass;
use super::activation::Activation;
use super::matmul::{Shape, add_forward, add_weight_gradient, input_gradient};
use rand::{Rng, RngExt};
use std::ops::Range;

/// Layers widths\[0\] -> widths\[1\] -> ... -> widths\[last\]; all but the last are followed by the activation.
#[derive(Clone, Debug, PartialEq)]
pub struct Mlp {
    widths: Vec<usize>,
    activation: Activation,
    params: Vec<f32>,
}

/// Rows that go through all layers before the next rows do, so that their activations stay in the processor's cache.
const BLOCK_ROWS: usize = 128;

fn blocks(rows: Range<usize>) -> impl Iterator<Item = Range<usize>> {
    let end = rows.end;
    rows.step_by(BLOCK_ROWS).map(move |from| from..end.min(from + BLOCK_ROWS))
}

impl Mlp {
    /// A network with weights and biases drawn uniformly from +-1/sqrt(inputs of the layer).
    ///
    /// # Panics
    /// With fewer than two hidden widths plus input and output, or a width of 0.
    pub fn new(widths: &[usize], activation: Activation, rng: &mut impl Rng) -> Self {
        assert!(widths.len() >= 3 && widths.iter().all(|w| *w > 0), "an MLP needs a hidden layer and no empty width: {widths:?}");
        let mut params = Vec::with_capacity(Self::count(widths));
        for pair in widths.windows(2) {
            let bound = 1.0 / (pair[0] as f32).sqrt();
            params.extend((0..(pair[0] + 1) * pair[1]).map(|_| bound * (2.0 * rng.random::<f32>() - 1.0)));
        }
        Mlp { widths: widths.to_vec(), activation, params }
    }

    /// From parameters, laid out as [`Mlp::params`]; `None` when their number does not fit.
    pub fn from_params(widths: &[usize], activation: Activation, params: Vec<f32>) -> Option<Self> {
        (widths.len() >= 3 && params.len() == Self::count(widths)).then(|| Mlp { widths: widths.to_vec(), activation, params })
    }

    fn count(widths: &[usize]) -> usize {
        widths.windows(2).map(|pair| (pair[0] + 1) * pair[1]).sum()
    }

    /// Widths of all layers, input first.
    pub fn widths(&self) -> &[usize] {
        &self.widths
    }

    /// The activation of the hidden layers.
    pub fn activation(&self) -> Activation {
        self.activation
    }

    /// All parameters: per layer the weights (inputs x outputs, row-major), then the biases.
    pub fn params(&self) -> &[f32] {
        &self.params
    }

    /// The same, to be changed.
    pub fn params_mut(&mut self) -> &mut [f32] {
        &mut self.params
    }

    /// Number of inputs.
    pub fn inputs(&self) -> usize {
        self.widths[0]
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.widths[self.layers()]
    }

    /// Number of linear layers.
    pub fn layers(&self) -> usize {
        self.widths.len() - 1
    }

    /// Where layer `layer`'s weights and biases stand in the parameters.
    pub fn layer_ranges(&self, layer: usize) -> (Range<usize>, Range<usize>) {
        let start = Self::count(&self.widths[..=layer]);
        let weights = self.widths[layer] * self.widths[layer + 1];
        (start..start + weights, start + weights..start + weights + self.widths[layer + 1])
    }

    fn shape(&self, layer: usize, rows: &Range<usize>) -> Shape {
        Shape { rows: rows.len(), inputs: self.widths[layer], outputs: self.widths[layer + 1] }
    }

    /// Floating point operations of a forward pass over one row (backward costs the same again for the inputs and for the weights).
    pub fn flops_per_row(&self) -> u64 {
        (0..self.layers()).map(|layer| self.shape(layer, &(0..1)).flops()).sum()
    }

    /// The first layer's share of [`Mlp::flops_per_row`].
    pub fn first_layer_flops_per_row(&self) -> u64 {
        self.shape(0, &(0..1)).flops()
    }

    /// `pass.output` of `rows` from `pass.input`.
    pub fn forward(&self, pass: &mut Pass, rows: Range<usize>) {
        blocks(rows).for_each(|block| self.forward_block(pass, block));
    }

    fn forward_block(&self, pass: &mut Pass, rows: Range<usize>) {
        for layer in 0..self.layers() {
            let shape = self.shape(layer, &rows);
            let (weights, biases) = self.layer_ranges(layer);
            let (below, above) = pass.hidden.split_at_mut(layer);
            let x = if layer == 0 { &pass.input } else { &below[layer - 1] };
            let y = if layer + 1 == self.layers() { &mut pass.output } else { &mut above[0] };
            let y = span_mut(y, &rows, shape.outputs);
            y.chunks_exact_mut(shape.outputs).for_each(|row| row.copy_from_slice(&self.params[biases.clone()]));
            add_forward(shape, y, span(x, &rows, shape.inputs), &self.params[weights]);
            if layer + 1 < self.layers() {
                self.activation.forward(y);
            }
        }
    }

    /// Gradients of the hidden layers of `rows` from `pass.d_output`; they stay in the workspace for the two calls below.
    pub fn backward(&self, pass: &mut Pass, rows: Range<usize>) {
        blocks(rows).for_each(|block| self.backward_block(pass, block));
    }

    fn backward_block(&self, pass: &mut Pass, rows: Range<usize>) {
        for layer in (1..self.layers()).rev() {
            let shape = self.shape(layer, &rows);
            let (weights, _) = self.layer_ranges(layer);
            let (below, above) = pass.d_hidden.split_at_mut(layer);
            let dy = if layer + 1 == self.layers() { &pass.d_output } else { &above[0] };
            let dx = span_mut(&mut below[layer - 1], &rows, shape.inputs);
            input_gradient(shape, dx, span(dy, &rows, shape.outputs), &self.params[weights]);
            self.activation.backward(dx, span(&pass.hidden[layer - 1], &rows, shape.inputs));
        }
    }

    /// `pass.d_input` of `rows`, after [`Mlp::backward`].
    pub fn backward_input(&self, pass: &mut Pass, rows: Range<usize>) {
        let shape = self.shape(0, &rows);
        let (weights, _) = self.layer_ranges(0);
        let dx = span_mut(&mut pass.d_input, &rows, shape.inputs);
        input_gradient(shape, dx, span(&pass.d_hidden[0], &rows, shape.outputs), &self.params[weights]);
    }

    /// Adds the parameters' gradient over `rows` to `gradient`, after [`Mlp::backward`].
    ///
    /// # Panics
    /// When `gradient` is shorter than the parameters.
    pub fn add_gradient(&self, pass: &Pass, rows: Range<usize>, gradient: &mut [f32]) {
        blocks(rows).for_each(|block| self.add_gradient_block(pass, block, gradient));
    }

    fn add_gradient_block(&self, pass: &Pass, rows: Range<usize>, gradient: &mut [f32]) {
        for layer in 0..self.layers() {
            let shape = self.shape(layer, &rows);
            let (weights, biases) = self.layer_ranges(layer);
            let x = if layer == 0 { &pass.input } else { &pass.hidden[layer - 1] };
            let dy = if layer + 1 == self.layers() { &pass.d_output } else { &pass.d_hidden[layer] };
            let dy = span(dy, &rows, shape.outputs);
            add_weight_gradient(shape, &mut gradient[weights], span(x, &rows, shape.inputs), dy);
            let d_bias = &mut gradient[biases];
            dy.chunks_exact(shape.outputs).for_each(|row| d_bias.iter_mut().zip(row).for_each(|(sum, d)| *sum += d));
        }
    }
}

fn span<'a>(array: &'a [f32], rows: &Range<usize>, width: usize) -> &'a [f32] {
    &array[rows.start * width..rows.end * width]
}

fn span_mut<'a>(array: &'a mut [f32], rows: &Range<usize>, width: usize) -> &'a mut [f32] {
    &mut array[rows.start * width..rows.end * width]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::stream;

    /// L = sum c_k y_k^2 over all rows; its derivative by finite differences against backward, for parameters and inputs.
    #[test]
    fn gradients_of_every_layer_equal_finite_differences() {
        for activation in [Activation::Tanh, Activation::Relu] {
            let mut rng = stream(1, "mlp", 0);
            let mut mlp = Mlp::new(&[4, 7, 6, 3], activation, &mut rng);
            let rows = 5;
            let mut pass = Pass::new(&mlp, rows);
            pass.input.iter_mut().for_each(|v| *v = 2.0 * rng.random::<f32>() - 1.0);
            let loss = |mlp: &Mlp, pass: &mut Pass| -> f64 {
                mlp.forward(pass, 0..rows);
                pass.output.iter().enumerate().map(|(k, y)| (1.0 + k as f64) * f64::from(*y).powi(2)).sum()
            };
            loss(&mlp, &mut pass);
            for k in 0..pass.output.len() {
                pass.d_output[k] = 2.0 * (1.0 + k as f32) * pass.output[k];
            }
            mlp.backward(&mut pass, 0..2);
            mlp.backward(&mut pass, 2..rows);
            mlp.backward_input(&mut pass, 0..rows);
            let mut gradient = vec![0.0; mlp.params().len()];
            mlp.add_gradient(&pass, 0..3, &mut gradient);
            mlp.add_gradient(&pass, 3..rows, &mut gradient);
            let h = 2e-3f32;
            let check = |analytic: f32, plus: f64, minus: f64, what: &str| {
                let numeric = (plus - minus) / f64::from(2.0 * h);
                assert!(
                    (numeric - f64::from(analytic)).abs() < 2e-2 * (1.0 + numeric.abs()),
                    "{what}: {analytic} against {numeric}"
                );
            };
            for (i, analytic) in gradient.iter().enumerate() {
                let mut at = |sign: f32| {
                    let kept = mlp.params[i];
                    mlp.params[i] += sign * h;
                    let value = loss(&mlp, &mut pass);
                    mlp.params[i] = kept;
                    value
                };
                check(*analytic, at(1.0), at(-1.0), &format!("{activation:?} parameter {i}"));
            }
            for i in 0..pass.input.len() {
                let (kept, analytic) = (pass.input[i], pass.d_input[i]);
                let mut at = |sign: f32| {
                    pass.input[i] = kept + sign * h;
                    let value = loss(&mlp, &mut pass);
                    pass.input[i] = kept;
                    value
                };
                check(analytic, at(1.0), at(-1.0), &format!("{activation:?} input {i}"));
            }
        }
    }
}
