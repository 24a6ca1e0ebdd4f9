//! The workspace of forward and backward.

use super::Mlp;

/// Activations and their gradients for up to `capacity` rows: the workspace of one thread.
#[derive(Clone, Debug, Default)]
pub struct Pass {
    /// Inputs, rows x widths\[0\].
    pub input: Vec<f32>,
    /// Outputs, rows x widths\[last\].
    pub output: Vec<f32>,
    /// Gradient of the loss with respect to the outputs, to be set before [`Mlp::backward`].
    pub d_output: Vec<f32>,
    /// Gradient with respect to the inputs, set by [`Mlp::backward_input`].
    pub d_input: Vec<f32>,
    pub(super) hidden: Vec<Vec<f32>>,
    pub(super) d_hidden: Vec<Vec<f32>>,
    capacity: usize,
}

impl Pass {
    /// A workspace for `rows` rows of `mlp`.
    pub fn new(mlp: &Mlp, rows: usize) -> Self {
        let mut pass = Pass::default();
        pass.reserve(mlp, rows);
        pass
    }

    /// Makes room for `rows` rows; keeps what is there and never shrinks.
    pub fn reserve(&mut self, mlp: &Mlp, rows: usize) {
        if rows <= self.capacity && !self.hidden.is_empty() {
            return;
        }
        let hidden = &mlp.widths()[1..mlp.layers()];
        self.hidden.resize(hidden.len(), Vec::new());
        self.d_hidden.resize(hidden.len(), Vec::new());
        for (i, width) in hidden.iter().enumerate() {
            self.hidden[i].resize(rows * width, 0.0);
            self.d_hidden[i].resize(rows * width, 0.0);
        }
        for (array, width) in [
            (&mut self.input, mlp.inputs()),
            (&mut self.d_input, mlp.inputs()),
            (&mut self.output, mlp.outputs()),
            (&mut self.d_output, mlp.outputs()),
        ] {
            array.resize(rows * width, 0.0);
        }
        self.capacity = rows;
    }
}
