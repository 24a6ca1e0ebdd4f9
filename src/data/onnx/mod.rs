//! Networks as ONNX, for programs that are not hilt: a graph of standard operators on single precision. Nothing here reads them back.

mod graph;
mod proto;

pub use graph::{Graph, Op, Port, Value};

use super::{Provenance, provenance, seal};
use prost::Message;
use proto::{
    ModelProto, OperatorSetIdProto, StringStringEntryProto, TensorShapeProto, TypeProto, ValueInfoProto, tensor_shape_proto,
    type_proto,
};

/// Who writes these files.
pub const PRODUCER: &str = "hilt";
/// The stage that they are of.
pub const EXPORT: &str = "export";
/// Version of ONNX's own operators that the graph is written in: that of ONNX 1.8 (2020), which every runtime since then takes.
pub const OPSET: i64 = 13;
/// Version of the format, of the same ONNX.
const IR_VERSION: i64 = 7;
/// The type of single precision.
const FLOAT: i32 = 1;
/// What the free size is called: rows that are worked on at once.
const BATCH: &str = "batch";
/// The seal's key among the metadata.
const SEAL: &str = "seal";

/// The bytes of an ONNX file with `graph`: `doc` says what it is, `metadata` what there is to know beside it, `provenance` what made the network.
pub fn encode(graph: Graph, doc: &str, metadata: Vec<(String, String)>, provenance: &Provenance) -> Vec<u8> {
    let own = [(provenance::KEY.to_string(), provenance.to_json()), (SEAL.into(), seal::blank())];
    let entry = |(key, value)| StringStringEntryProto { key: Some(key), value: Some(value) };
    let model = ModelProto {
        ir_version: Some(IR_VERSION),
        producer_name: Some(PRODUCER.into()),
        producer_version: Some(env!("CARGO_PKG_VERSION").into()),
        doc_string: Some(doc.into()),
        graph: Some(graph.into_proto()),
        opset_import: vec![OperatorSetIdProto { domain: Some(String::new()), version: Some(OPSET) }],
        metadata_props: metadata.into_iter().chain(own).map(entry).collect(),
    };
    seal::close(model.encode_to_vec())
}

/// An input or output as the format has it.
fn value_info(port: Port) -> ValueInfoProto {
    use tensor_shape_proto::{Dimension, dimension::Value};
    let sizes = [Value::DimParam(BATCH.into()), Value::DimValue(port.width as i64)];
    let shape = TensorShapeProto { dim: sizes.map(|size| Dimension { value: Some(size) }).into() };
    let tensor = type_proto::Tensor { elem_type: Some(FLOAT), shape: Some(shape) };
    ValueInfoProto {
        name: Some(port.name),
        r#type: Some(TypeProto { value: Some(type_proto::Value::TensorType(tensor)) }),
        doc_string: Some(port.doc),
    }
}
