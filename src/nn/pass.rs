//! The workspace of forward and backward.

use super::kernel::{Coefficients, Finish, Product, Start, product, transpose, wide};
use super::lanes::{LANES, Lanes, panels_of};
use super::panels::{Panels, read_panel};

/// Panels that had best go through forward, backward and the gradient before the next do: their activations then wait in a core's second
/// cache (200 to 400 kB for a network of three times 100), and the sums of the gradient still stay in registers for long.
pub const BLOCK_PANELS: usize = 12;

/// Activations and their gradients: the workspace of one thread. Lanes that hold no row must hold finite inputs and zeros in `d_output`.
#[derive(Clone, Debug, Default)]
pub struct Pass {
    /// Inputs, widths\[0\] entries.
    pub input: Panels,
    /// Outputs, widths\[last\] entries.
    pub output: Panels,
    /// Gradient of the loss with respect to the outputs, to be set before [`super::Mlp::backward`].
    pub d_output: Panels,
    /// Gradient with respect to the inputs, set by [`super::Mlp::backward_input`].
    pub d_input: Panels,
    pub(super) hidden: Vec<Panels>,
    pub(super) d_hidden: Vec<Panels>,
    pub(super) sums: GradientSums,
}

/// A network's gradient while it is summed. Per layer, lanes run over the inputs, so that x^T dy is a product like the others; a bias is
/// the weight of one more input, which is always 1.
#[derive(Clone, Debug, Default)]
pub(super) struct GradientSums {
    /// Samples with inputs for lanes: \[(inputs + 1) / 8\]\[samples\], in as much of it as a layer needs.
    x: Vec<Lanes>,
    /// Sums so far, layer by layer: \[(inputs + 1) / 8\]\[outputs\].
    layers: Vec<Vec<Lanes>>,
    /// Whether a layer's sums are still to begin.
    fresh: Vec<bool>,
}

impl GradientSums {
    /// Starts the sums of layers of these widths.
    pub fn begin(&mut self, widths: &[usize]) {
        self.layers.resize_with(widths.len() - 1, Vec::new);
        for (sums, pair) in self.layers.iter_mut().zip(widths.windows(2)) {
            sums.resize(panels_of(pair[0] + 1) * pair[1], Lanes::default());
        }
        let inputs = widths[..widths.len() - 1].iter().max().copied().unwrap_or(0);
        self.x.resize(panels_of(inputs + 1) * BLOCK_PANELS * LANES, Lanes::default());
        self.fresh.clear();
        self.fresh.resize(widths.len() - 1, true);
    }

    /// Adds x^T dy to a layer's sums, from at most [`BLOCK_PANELS`] panels of `inputs` and of `outputs` entries.
    pub fn add(&mut self, layer: usize, x: &[Lanes], inputs: usize, dy: &[Lanes], outputs: usize) {
        let depth = x.len() / inputs * LANES;
        let turned = &mut self.x[..panels_of(inputs + 1) * depth];
        transpose(turned, x, inputs);
        let start = if std::mem::replace(&mut self.fresh[layer], false) { Start::Zero } else { Start::Result };
        let of = Product { x: turned, depth, a: Coefficients::Samples(dy), start, finish: Finish::Nothing };
        product(&mut self.layers[layer], outputs, of);
    }

    /// Adds the sums of another part of the samples.
    pub fn absorb(&mut self, other: &GradientSums) {
        let fresh = self.fresh.iter_mut().zip(&other.fresh);
        for ((sums, others), (fresh, other_fresh)) in self.layers.iter_mut().zip(&other.layers).zip(fresh) {
            match (*fresh, *other_fresh) {
                (_, true) => {}
                (true, false) => sums.copy_from_slice(others),
                (false, false) => wide(|| sums.iter_mut().zip(others).for_each(|(sum, other)| *sum += *other)),
            }
            *fresh &= *other_fresh;
        }
    }

    /// Writes a layer's sums into its part of the gradient: weights inputs x outputs, then biases.
    pub fn write(&self, layer: usize, gradient: &mut [f32], outputs: usize) {
        if self.fresh[layer] {
            return gradient.fill(0.0);
        }
        let panels = self.layers[layer].chunks_exact(outputs);
        panels.zip(gradient.chunks_mut(LANES * outputs)).for_each(|(sums, rows)| read_panel(sums, rows));
    }
}
