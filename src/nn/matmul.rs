//! The three matrix products of a linear layer, row-major, on one thread.
//!
//! Weights are stored inputs x outputs: the forward product and the weight gradient then need no repacking of their left side.

use gemm::{Parallelism, gemm};

/// Sizes of a linear layer on a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// Rows of the batch.
    pub rows: usize,
    /// Inputs of the layer.
    pub inputs: usize,
    /// Outputs of the layer.
    pub outputs: usize,
}

impl Shape {
    fn check(self, x: &[f32], w: &[f32], y: &[f32]) {
        assert!(x.len() >= self.rows * self.inputs, "x holds {} numbers, {self:?} needs more", x.len());
        assert!(w.len() >= self.inputs * self.outputs, "w holds {} numbers, {self:?} needs more", w.len());
        assert!(y.len() >= self.rows * self.outputs, "y holds {} numbers, {self:?} needs more", y.len());
    }

    /// Floating point operations of one product (a multiplication and an addition count as two).
    pub fn flops(self) -> u64 {
        2 * (self.rows * self.inputs * self.outputs) as u64
    }
}

/// y += x w, with x rows x inputs, w inputs x outputs, y rows x outputs.
///
/// # Panics
/// When a slice is shorter than its shape.
pub fn add_forward(shape: Shape, y: &mut [f32], x: &[f32], w: &[f32]) {
    shape.check(x, w, y);
    let Shape { rows, inputs, outputs } = shape;
    let (i, o) = (inputs as isize, outputs as isize);
    // SAFETY: the lengths were checked above; strides address row-major arrays within them; y does not alias x or w.
    unsafe {
        let (y, x, w) = (y.as_mut_ptr(), x.as_ptr(), w.as_ptr());
        let one = Parallelism::None;
        gemm(rows, outputs, inputs, y, 1, o, true, x, 1, i, w, 1, o, 1.0, 1.0, false, false, false, one);
    }
}

/// dx = dy w^T: the gradient with respect to a layer's inputs.
///
/// # Panics
/// When a slice is shorter than its shape.
pub fn input_gradient(shape: Shape, dx: &mut [f32], dy: &[f32], w: &[f32]) {
    shape.check(dx, w, dy);
    let Shape { rows, inputs, outputs } = shape;
    let (i, o) = (inputs as isize, outputs as isize);
    // SAFETY: as above; dx does not alias dy or w.
    unsafe {
        let (dx, dy, w) = (dx.as_mut_ptr(), dy.as_ptr(), w.as_ptr());
        let one = Parallelism::None;
        gemm(rows, inputs, outputs, dx, 1, i, false, dy, 1, o, w, o, 1, 0.0, 1.0, false, false, false, one);
    }
}

/// dw += x^T dy: the gradient with respect to a layer's weights.
///
/// # Panics
/// When a slice is shorter than its shape.
pub fn add_weight_gradient(shape: Shape, dw: &mut [f32], x: &[f32], dy: &[f32]) {
    shape.check(x, dw, dy);
    let Shape { rows, inputs, outputs } = shape;
    let (i, o) = (inputs as isize, outputs as isize);
    // SAFETY: as above; dw does not alias x or dy.
    unsafe {
        let (dw, x, dy) = (dw.as_mut_ptr(), x.as_ptr(), dy.as_ptr());
        let one = Parallelism::None;
        gemm(inputs, outputs, rows, dw, 1, o, true, x, i, 1, dy, 1, o, 1.0, 1.0, false, false, false, one);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_equal_plain_loops() {
        let shape = Shape { rows: 7, inputs: 5, outputs: 3 };
        let value = |i: usize| ((i * 37 % 19) as f32 - 9.0) / 7.0;
        let x: Vec<f32> = (0..35).map(value).collect();
        let w: Vec<f32> = (0..15).map(|i| value(i + 3)).collect();
        let dy: Vec<f32> = (0..21).map(|i| value(i + 5)).collect();
        let (mut y, mut dx, mut dw) = (vec![1.0; 21], vec![9.0; 35], vec![1.0; 15]);
        add_forward(shape, &mut y, &x, &w);
        input_gradient(shape, &mut dx, &dy, &w);
        add_weight_gradient(shape, &mut dw, &x, &dy);
        let close = |a: f32, b: f32| assert!((a - b).abs() < 1e-4, "{a} against {b}");
        for r in 0..7 {
            (0..3).for_each(|o| close(y[r * 3 + o], 1.0 + (0..5).map(|i| x[r * 5 + i] * w[i * 3 + o]).sum::<f32>()));
            (0..5).for_each(|i| close(dx[r * 5 + i], (0..3).map(|o| dy[r * 3 + o] * w[i * 3 + o]).sum::<f32>()));
        }
        for i in 0..5 {
            (0..3).for_each(|o| close(dw[i * 3 + o], 1.0 + (0..7).map(|r| x[r * 5 + i] * dy[r * 3 + o]).sum::<f32>()));
        }
    }
}
