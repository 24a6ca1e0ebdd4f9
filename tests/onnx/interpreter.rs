//! The few operators of ONNX that exported graphs are made of, as ONNX describes them, in single precision: it knows nothing of hilt.

use prost::Message;
use std::collections::HashMap;

#[allow(clippy::all, reason = "generated code")]
pub mod proto {
    include!(concat!(env!("OUT_DIR"), "/onnx.rs"));
}

use proto::{ModelProto, NodeProto, TensorProto, tensor_shape_proto::dimension, type_proto};

/// An array of numbers, row-major; indices too, which are small enough.
#[derive(Clone, Debug, PartialEq)]
pub struct Tensor {
    pub shape: Vec<usize>,
    pub data: Vec<f32>,
}

pub fn model(bytes: &[u8]) -> ModelProto {
    ModelProto::decode(bytes).expect("a protobuf")
}

/// Name, width and description of the only input, or of the only output.
pub fn port(ports: &[proto::ValueInfoProto]) -> (&str, usize, &str) {
    let [port] = ports else { panic!("{} ports", ports.len()) };
    let Some(type_proto::Value::TensorType(tensor)) = port.r#type.as_ref().and_then(|t| t.value.as_ref()) else {
        panic!("no tensor")
    };
    assert_eq!(tensor.elem_type, Some(1), "single precision");
    let sizes: Vec<_> = tensor.shape.iter().flat_map(|shape| &shape.dim).filter_map(|d| d.value.as_ref()).collect();
    let [dimension::Value::DimParam(batch), dimension::Value::DimValue(width)] = sizes[..] else { panic!("{sizes:?}") };
    assert_eq!(batch, "batch");
    (port.name(), *width as usize, port.doc_string())
}

/// What the graph makes of its input.
pub fn run(model: &ModelProto, input: Tensor) -> Tensor {
    let graph = model.graph.as_ref().expect("a graph");
    let mut values: HashMap<&str, Tensor> = graph.initializer.iter().map(|t| (t.name(), constant(t))).collect();
    values.insert(port(&graph.input).0, input);
    for node in &graph.node {
        assert!(node.output.iter().all(|name| !values.contains_key(name.as_str())), "{} twice", node.name());
        let inputs: Vec<&Tensor> = node.input.iter().map(|name| &values[name.as_str()]).collect();
        let outputs = apply(node, &inputs);
        assert_eq!(outputs.len(), node.output.len());
        values.extend(node.output.iter().map(String::as_str).zip(outputs));
    }
    values.remove(port(&graph.output).0).expect("the output")
}

fn constant(tensor: &TensorProto) -> Tensor {
    let bytes = tensor.raw_data();
    let data: Vec<f32> = match tensor.data_type() {
        1 => bytes.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect(),
        7 => bytes.as_chunks().0.iter().map(|b| i64::from_le_bytes(*b) as f32).collect(),
        other => panic!("type {other}"),
    };
    let shape: Vec<usize> = tensor.dims.iter().map(|n| *n as usize).collect();
    assert_eq!(shape.iter().product::<usize>(), data.len(), "{}", tensor.name());
    Tensor { shape, data }
}

#[expect(clippy::disallowed_methods, reason = "another program has the tanh of its system")]
fn apply(node: &NodeProto, inputs: &[&Tensor]) -> Vec<Tensor> {
    let axis = || node.attribute.iter().find(|a| a.name() == "axis").and_then(|a| a.i).expect("an axis") as usize;
    let one = match node.op_type() {
        "Add" => elementwise(inputs[0], inputs[1], |a, b| a + b),
        "Sub" => elementwise(inputs[0], inputs[1], |a, b| a - b),
        "Mul" => elementwise(inputs[0], inputs[1], |a, b| a * b),
        "Div" => elementwise(inputs[0], inputs[1], |a, b| a / b),
        "Round" => map(inputs[0], f32::round_ties_even),
        "Floor" => map(inputs[0], f32::floor),
        "Tanh" => map(inputs[0], f32::tanh),
        "Relu" => map(inputs[0], |v| v.max(0.0)),
        "Gemm" => gemm(inputs[0], inputs[1], inputs[2]),
        "Concat" => concat(inputs, axis()),
        "Gather" => gather(inputs[0], inputs[1], axis()),
        "Split" => return split(inputs[0], axis(), node.output.len()),
        "Flatten" => {
            let rows = inputs[0].shape[0];
            Tensor { shape: vec![rows, inputs[0].data.len() / rows], data: inputs[0].data.clone() }
        }
        "Unsqueeze" => {
            let mut shape = inputs[0].shape.clone();
            shape.insert(inputs[1].data[0] as usize, 1);
            Tensor { shape, data: inputs[0].data.clone() }
        }
        other => panic!("operator {other}"),
    };
    vec![one]
}

fn map(x: &Tensor, f: impl Fn(f32) -> f32) -> Tensor {
    Tensor { shape: x.shape.clone(), data: x.data.iter().map(|v| f(*v)).collect() }
}

/// With the broadcasting of NumPy: axes count from the last, one of size 1 or that is missing serves all.
fn elementwise(a: &Tensor, b: &Tensor, f: impl Fn(f32, f32) -> f32) -> Tensor {
    let axes = a.shape.len().max(b.shape.len());
    let size = |t: &Tensor, axis: usize| (axis + t.shape.len()).checked_sub(axes).map_or(1, |i| t.shape[i]);
    let shape: Vec<usize> = (0..axes)
        .map(|axis| {
            let (one, other) = (size(a, axis), size(b, axis));
            assert!(one == other || one == 1 || other == 1, "{:?} and {:?}", a.shape, b.shape);
            one.max(other)
        })
        .collect();
    let at = |t: &Tensor, mut place: usize| {
        let (mut offset, mut stride) = (0, 1);
        for axis in (0..axes).rev() {
            let size = size(t, axis);
            offset += stride * (place % shape[axis]).min(size - 1);
            (stride, place) = (stride * size, place / shape[axis]);
        }
        t.data[offset]
    };
    let data = (0..shape.iter().product()).map(|place| f(at(a, place), at(b, place))).collect();
    Tensor { shape, data }
}

fn gemm(x: &Tensor, w: &Tensor, b: &Tensor) -> Tensor {
    let (inputs, outputs) = (w.shape[0], w.shape[1]);
    assert_eq!((x.shape.len(), x.shape[1], &b.shape[..]), (2, inputs, &[outputs][..]));
    let sum = |row: &[f32], o: usize| b.data[o] + row.iter().enumerate().map(|(i, v)| v * w.data[i * outputs + o]).sum::<f32>();
    let data = x.data.chunks(inputs).flat_map(|row| (0..outputs).map(move |o| sum(row, o))).collect();
    Tensor { shape: vec![x.shape[0], outputs], data }
}

/// Rows before an axis, and numbers behind each of its entries.
fn around(shape: &[usize], axis: usize) -> (usize, usize) {
    (shape[..axis].iter().product(), shape[axis + 1..].iter().product())
}

fn concat(parts: &[&Tensor], axis: usize) -> Tensor {
    let mut shape = parts[0].shape.clone();
    for part in parts {
        let same = |k: usize| k == axis || part.shape[k] == shape[k];
        assert!(part.shape.len() == shape.len() && (0..shape.len()).all(same), "{:?} beside {shape:?}", part.shape);
    }
    shape[axis] = parts.iter().map(|part| part.shape[axis]).sum();
    let (rows, _) = around(&shape, axis);
    let of_row =
        |row: usize| parts.iter().flat_map(move |part| part.data.chunks(part.data.len() / rows).nth(row).expect("a row"));
    Tensor { data: (0..rows).flat_map(of_row).copied().collect(), shape }
}

fn gather(x: &Tensor, indices: &Tensor, axis: usize) -> Tensor {
    let (rows, behind) = around(&x.shape, axis);
    let shape = [&x.shape[..axis], &indices.shape, &x.shape[axis + 1..]].concat();
    let mut data = Vec::new();
    for row in 0..rows {
        for index in &indices.data {
            let start = (row * x.shape[axis] + *index as usize) * behind;
            data.extend(&x.data[start..start + behind]);
        }
    }
    Tensor { shape, data }
}

fn split(x: &Tensor, axis: usize, parts: usize) -> Vec<Tensor> {
    let size = x.shape[axis] / parts;
    assert_eq!(size * parts, x.shape[axis], "parts of equal size");
    let of_part = |part: usize| {
        let indices: Vec<f32> = (part * size..(part + 1) * size).map(|i| i as f32).collect();
        gather(x, &Tensor { shape: vec![size], data: indices }, axis)
    };
    (0..parts).map(of_part).collect()
}
