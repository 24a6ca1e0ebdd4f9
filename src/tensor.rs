//! Named arrays: how a network's parameters leave and enter memory. Files are made of them in `data`.

/// A row-major f32 array with a name and a shape.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedTensor {
    /// Name, e.g. `policy.layer_1.weight`.
    pub name: String,
    /// Shape, outermost first.
    pub shape: Vec<usize>,
    /// Values, row-major; as many as the product of the shape.
    pub data: Vec<f32>,
}
