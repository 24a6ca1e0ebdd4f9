//! A graph under construction: constants, and operators one after another.

use super::proto::{AttributeProto, GraphProto, NodeProto, TensorProto};
use super::{FLOAT, value_info};

/// The type of 64-bit integers, of which indices are.
const INT64: i32 = 7;
/// An attribute that holds an integer.
const INT: i32 = 2;

/// An operator of ONNX's own; what it does to shapes is ONNX's word, too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Op {
    /// a + b; one row serves all.
    Add,
    /// a - b.
    Sub,
    /// a times b.
    Mul,
    /// a / b.
    Div,
    /// To the nearest integer.
    Round,
    /// To the next integer below.
    Floor,
    /// Hyperbolic tangent.
    Tanh,
    /// max(0, x).
    Relu,
    /// x W + b.
    Gemm,
    /// Side by side along an axis.
    Concat(i64),
    /// The entries with these numbers along an axis.
    Gather(i64),
    /// Parts of equal size along an axis.
    Split(i64),
    /// All axes from the second on become one.
    Flatten,
    /// Another axis of size 1, whose number is the second input.
    Unsqueeze,
}

impl Op {
    fn name(self) -> &'static str {
        match self {
            Op::Add => "Add",
            Op::Sub => "Sub",
            Op::Mul => "Mul",
            Op::Div => "Div",
            Op::Round => "Round",
            Op::Floor => "Floor",
            Op::Tanh => "Tanh",
            Op::Relu => "Relu",
            Op::Gemm => "Gemm",
            Op::Concat(_) => "Concat",
            Op::Gather(_) => "Gather",
            Op::Split(_) => "Split",
            Op::Flatten => "Flatten",
            Op::Unsqueeze => "Unsqueeze",
        }
    }

    fn axis(self) -> Option<i64> {
        match self {
            Op::Concat(axis) | Op::Gather(axis) | Op::Split(axis) => Some(axis),
            _ => None,
        }
    }
}

/// The name of what flows along an edge of the graph.
pub type Value = String;

/// An input or output: rows of so many numbers, any number of them at once.
#[derive(Clone, Debug, PartialEq)]
pub struct Port {
    /// Its name.
    pub name: Value,
    /// Numbers of a row.
    pub width: usize,
    /// What they are, with their units.
    pub doc: String,
}

/// Operators in the order in which they run.
#[derive(Clone, Debug, Default)]
pub struct Graph {
    proto: GraphProto,
}

impl Graph {
    /// Without any operator.
    pub fn new(name: &str) -> Self {
        Graph { proto: GraphProto { name: Some(name.into()), ..GraphProto::default() } }
    }

    /// Adds an input.
    pub fn input(&mut self, port: Port) -> Value {
        let name = port.name.clone();
        self.proto.input.push(value_info(port));
        name
    }

    /// Makes an output of the value of this name.
    pub fn output(&mut self, port: Port) {
        self.proto.output.push(value_info(port));
    }

    /// Adds numbers, row-major.
    pub fn constant(&mut self, name: &str, shape: &[usize], numbers: &[f32]) -> Value {
        self.push_constant(name, shape, FLOAT, numbers.iter().flat_map(|v| v.to_le_bytes()).collect())
    }

    /// Adds indices, row-major.
    pub fn indices(&mut self, name: &str, shape: &[usize], indices: &[usize]) -> Value {
        self.push_constant(name, shape, INT64, indices.iter().flat_map(|i| (*i as i64).to_le_bytes()).collect())
    }

    fn push_constant(&mut self, name: &str, shape: &[usize], data_type: i32, raw_data: Vec<u8>) -> Value {
        self.proto.initializer.push(TensorProto {
            dims: shape.iter().map(|n| *n as i64).collect(),
            data_type: Some(data_type),
            name: Some(name.into()),
            raw_data: Some(raw_data),
        });
        name.into()
    }

    /// Adds an operator whose only output is called `name`, as it is itself.
    pub fn apply(&mut self, op: Op, inputs: &[&str], name: &str) -> Value {
        self.push(op, inputs, name, vec![name.into()]);
        name.into()
    }

    /// Cuts a value into `parts` of equal size along `axis`; they are called `name.1` and so on.
    pub fn split(&mut self, value: &str, axis: i64, parts: usize, name: &str) -> Vec<Value> {
        let outputs: Vec<Value> = (1..=parts).map(|i| format!("{name}.{i}")).collect();
        self.push(Op::Split(axis), &[value], &format!("{name}.split"), outputs.clone());
        outputs
    }

    fn push(&mut self, op: Op, inputs: &[&str], name: &str, output: Vec<Value>) {
        let axis = |axis| AttributeProto { name: Some("axis".into()), i: Some(axis), r#type: Some(INT) };
        self.proto.node.push(NodeProto {
            input: inputs.iter().map(|name| name.to_string()).collect(),
            output,
            name: Some(name.into()),
            op_type: Some(op.name().into()),
            attribute: op.axis().map(axis).into_iter().collect(),
        });
    }

    pub(super) fn into_proto(self) -> GraphProto {
        self.proto
    }
}
