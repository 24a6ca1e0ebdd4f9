//! The room that a network needs in a workspace.

use super::mlp::Mlp;
use super::panels::Panels;
use super::pass::Pass;

impl Pass {
    /// A workspace for `panels` panels of `mlp`.
    pub fn new(mlp: &Mlp, panels: usize) -> Self {
        let mut pass = Pass::default();
        pass.grow(mlp, panels);
        pass
    }

    /// Sees to it that [`Pass::grow`] for at most `panels` panels does not allocate, nor the gradient.
    pub fn reserve(&mut self, mlp: &Mlp, panels: usize) {
        self.grow(mlp, 0);
        for (i, width) in mlp.widths()[1..mlp.layers()].iter().enumerate() {
            self.hidden[i].reserve(*width, panels);
            self.d_hidden[i].reserve(*width, panels);
        }
        self.input.reserve(mlp.inputs(), panels);
        self.d_input.reserve(mlp.inputs(), panels);
        self.output.reserve(mlp.outputs(), panels);
        self.d_output.reserve(mlp.outputs(), panels);
        self.sums.begin(mlp.widths());
    }

    /// Makes room for `panels` panels; keeps what is there and never shrinks.
    pub fn grow(&mut self, mlp: &Mlp, panels: usize) {
        let hidden = &mlp.widths()[1..mlp.layers()];
        self.hidden.resize_with(hidden.len(), Panels::default);
        self.d_hidden.resize_with(hidden.len(), Panels::default);
        for (i, width) in hidden.iter().enumerate() {
            self.hidden[i].grow(*width, panels);
            self.d_hidden[i].grow(*width, panels);
        }
        self.input.grow(mlp.inputs(), panels);
        self.d_input.grow(mlp.inputs(), panels);
        self.output.grow(mlp.outputs(), panels);
        self.d_output.grow(mlp.outputs(), panels);
    }
}
