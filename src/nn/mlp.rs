//! A multilayer perceptron with a linear head; each backward stands under its forward.

use super::Pass;
use super::activation::Activation;
use super::kernel::{self, Coefficients, Finish, Product, Start, product};
use super::lanes::{LANES, Lanes};
use super::pass::BLOCK_PANELS;
use rand::{Rng, RngExt};
use std::ops::{Deref, DerefMut, Range};

/// Layers widths\[0\] -> widths\[1\] -> ... -> widths\[last\]; all but the last are followed by the activation.
#[derive(Clone, Debug, PartialEq)]
pub struct Mlp {
    widths: Vec<usize>,
    activation: Activation,
    params: Vec<f32>,
    /// The weights once more, each layer outputs x inputs in the place where `params` has it; the biases' places are not used.
    transposed: Vec<f32>,
}

/// Panels that go through all layers before the next do: as many as the largest tile of a product spans; two layers of 100 of them fit
/// into a core's first cache.
const STEP_PANELS: usize = 4;

/// Panels in steps: the last is of three where one panel would be left alone, which a product is slow on.
fn steps(panels: Range<usize>) -> impl Iterator<Item = Range<usize>> {
    let mut from = panels.start;
    std::iter::from_fn(move || {
        let left = panels.end - from;
        let size = if left == STEP_PANELS + 1 { left } else { left.min(STEP_PANELS) };
        from += size;
        (size > 0).then(|| from - size..from)
    })
}

/// Panels in blocks of [`BLOCK_PANELS`].
fn blocks(panels: Range<usize>) -> impl Iterator<Item = Range<usize>> {
    let end = panels.end;
    panels.step_by(BLOCK_PANELS).map(move |from| from..end.min(from + BLOCK_PANELS))
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
        Self::with_params(widths, activation, params)
    }

    fn with_params(widths: &[usize], activation: Activation, params: Vec<f32>) -> Self {
        let mut mlp = Mlp { widths: widths.to_vec(), activation, transposed: vec![0.0; params.len()], params };
        mlp.transpose();
        mlp
    }

    fn transpose(&mut self) {
        for layer in 0..self.layers() {
            let (weights, _) = self.layer_ranges(layer);
            let (inputs, outputs) = (self.widths[layer], self.widths[layer + 1]);
            let (from, to) = (&self.params[weights.clone()], &mut self.transposed[weights]);
            let whole = inputs / LANES * LANES; // eight rows at a time
            for i in (0..whole).step_by(LANES) {
                transpose_eight(&from[i * outputs..], outputs, &mut to[i..], inputs);
            }
            for (i, row) in from.chunks_exact(outputs).enumerate().skip(whole) {
                row.iter().enumerate().for_each(|(o, w)| to[o * inputs + i] = *w);
            }
        }
    }

    /// From parameters, laid out as [`Mlp::params`]; `None` when their number does not fit.
    pub fn from_params(widths: &[usize], activation: Activation, params: Vec<f32>) -> Option<Self> {
        (widths.len() >= 3 && params.len() == Self::count(widths)).then(|| Self::with_params(widths, activation, params))
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
    pub fn params_mut(&mut self) -> ParamsMut<'_> {
        ParamsMut { mlp: self }
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

    /// Floating point operations of a forward pass over one row, a multiplication and an addition counted as two (backward costs the
    /// same again for the inputs and for the weights).
    pub fn flops_per_row(&self) -> u64 {
        self.widths.windows(2).map(|pair| 2 * (pair[0] * pair[1]) as u64).sum()
    }

    /// The first layer's share of [`Mlp::flops_per_row`].
    pub fn first_layer_flops_per_row(&self) -> u64 {
        2 * (self.widths[0] * self.widths[1]) as u64
    }

    /// `pass.output` of these panels from `pass.input`.
    pub fn forward(&self, pass: &mut Pass, panels: Range<usize>) {
        steps(panels).for_each(|block| self.forward_block(pass, &block));
    }

    fn forward_block(&self, pass: &mut Pass, panels: &Range<usize>) {
        for layer in 0..self.layers() {
            let (inputs, outputs) = (self.widths[layer], self.widths[layer + 1]);
            let (weights, biases) = self.layer_ranges(layer);
            let (below, above) = pass.hidden.split_at_mut(layer);
            let x = if layer == 0 { &pass.input } else { &below[layer - 1] };
            let y = if layer + 1 == self.layers() { &mut pass.output } else { &mut above[0] };
            let (a, start) = (Coefficients::Matrix(&self.params[weights]), Start::Bias(&self.params[biases]));
            let finish = if layer + 1 < self.layers() { self.activation.forward() } else { Finish::Nothing };
            product(y.span_mut(panels), outputs, Product { x: x.span(panels), depth: inputs, a, start, finish });
        }
    }

    /// Gradients of the hidden layers of these panels from `pass.d_output`; they stay in the workspace for the two calls below.
    pub fn backward(&self, pass: &mut Pass, panels: Range<usize>) {
        steps(panels).for_each(|block| self.backward_block(pass, &block, &block));
    }

    /// The gradients of the hidden layers come to lie in `places`.
    fn backward_block(&self, pass: &mut Pass, panels: &Range<usize>, places: &Range<usize>) {
        for layer in (1..self.layers()).rev() {
            let (below, above) = pass.d_hidden.split_at_mut(layer);
            let dy = if layer + 1 == self.layers() { pass.d_output.span(panels) } else { above[0].span(places) };
            let (dx, y) = (below[layer - 1].span_mut(places), pass.hidden[layer - 1].span(panels));
            self.input_gradient(layer, dx, dy, self.activation.backward(y));
        }
    }

    /// `pass.d_input` of these panels, after [`Mlp::backward`].
    pub fn backward_input(&self, pass: &mut Pass, panels: Range<usize>) {
        self.input_gradient(0, pass.d_input.span_mut(&panels), pass.d_hidden[0].span(&panels), Finish::Nothing);
    }

    /// `pass.d_input` of these panels from `pass.d_output`, for a network that does not learn from it: the gradients of the hidden
    /// layers are soon overwritten, so that they need not leave the cache.
    pub fn backward_through(&self, pass: &mut Pass, panels: Range<usize>) {
        for block in steps(panels) {
            let places = 0..block.len();
            self.backward_block(pass, &block, &places);
            self.input_gradient(0, pass.d_input.span_mut(&block), pass.d_hidden[0].span(&places), Finish::Nothing);
        }
    }

    /// dx = finish(dy w^T).
    fn input_gradient(&self, layer: usize, dx: &mut [Lanes], dy: &[Lanes], finish: Finish) {
        let (weights, _) = self.layer_ranges(layer);
        let a = Coefficients::Matrix(&self.transposed[weights]);
        product(dx, self.widths[layer], Product { x: dy, depth: self.widths[layer + 1], a, start: Start::Zero, finish });
    }

    /// Starts the sum of the parameters' gradient in the workspace.
    pub fn begin_gradient(&self, pass: &mut Pass) {
        pass.sums.begin(&self.widths);
    }

    /// Adds these panels to the sum, after [`Mlp::backward`].
    pub fn add_gradient(&self, pass: &mut Pass, panels: Range<usize>) {
        blocks(panels).for_each(|block| self.add_block(pass, &block, &block));
    }

    /// [`Mlp::backward`] and [`Mlp::add_gradient`] in one, where nothing else is wanted of the gradients of the hidden layers: they are
    /// soon overwritten, so that they need not leave the cache.
    pub fn learn(&self, pass: &mut Pass, panels: Range<usize>) {
        for block in blocks(panels) {
            for places in steps(0..block.len()) {
                let step = block.start + places.start..block.start + places.end;
                self.backward_block(pass, &step, &places);
            }
            self.add_block(pass, &block, &(0..block.len()));
        }
    }

    /// Adds at most [`BLOCK_PANELS`] panels to the sum; the gradients of the hidden layers lie in `places`.
    fn add_block(&self, pass: &mut Pass, panels: &Range<usize>, places: &Range<usize>) {
        for layer in 0..self.layers() {
            let (inputs, outputs) = (self.widths[layer], self.widths[layer + 1]);
            let x = if layer == 0 { &pass.input } else { &pass.hidden[layer - 1] };
            let dy = if layer + 1 == self.layers() { pass.d_output.span(panels) } else { pass.d_hidden[layer].span(places) };
            pass.sums.add(layer, x.span(panels), inputs, dy, outputs);
        }
    }

    /// Writes the sum of all these workspaces' sums into `gradient`, laid out as the parameters. That of the first workspace comes to
    /// hold it too.
    ///
    /// # Panics
    /// When `gradient` is shorter than the parameters.
    pub fn finish_gradient<'a>(&self, passes: impl IntoIterator<Item = &'a mut Pass>, gradient: &mut [f32]) {
        let mut passes = passes.into_iter();
        let Some(total) = passes.next() else {
            return gradient.fill(0.0);
        };
        passes.for_each(|pass| total.sums.absorb(&pass.sums));
        for layer in 0..self.layers() {
            let (weights, biases) = self.layer_ranges(layer);
            total.sums.write(layer, &mut gradient[weights.start..biases.end], self.widths[layer + 1]);
        }
    }
}

/// Eight rows of `outputs` numbers become the first eight of each of so many rows of `inputs` numbers.
fn transpose_eight(from: &[f32], outputs: usize, to: &mut [f32], inputs: usize) {
    /// Columns at a time.
    const BLOCK: usize = 64;
    let mut block = [Lanes::default(); BLOCK];
    for start in (0..outputs).step_by(BLOCK) {
        let block = &mut block[..BLOCK.min(outputs - start)];
        kernel::interleave(block, std::array::from_fn(|r| &from[r * outputs + start..(r + 1) * outputs]));
        block.iter().zip(start..).for_each(|(column, o)| to[o * inputs..o * inputs + LANES].copy_from_slice(&column.0));
    }
}

/// The parameters on loan; when they come back, what is derived from them is brought up to date.
pub struct ParamsMut<'a> {
    mlp: &'a mut Mlp,
}

impl Deref for ParamsMut<'_> {
    type Target = [f32];
    fn deref(&self) -> &[f32] {
        &self.mlp.params
    }
}

impl DerefMut for ParamsMut<'_> {
    fn deref_mut(&mut self) -> &mut [f32] {
        &mut self.mlp.params
    }
}

impl Drop for ParamsMut<'_> {
    fn drop(&mut self) {
        self.mlp.transpose();
    }
}

#[cfg(test)]
mod tests;
