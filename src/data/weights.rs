//! Network weights as safetensors. The header's only metadata key, `hilt`, holds JSON: kind, what is needed to run the network,
//! the tensors' order, provenance and seal.

use super::{ContentHash, Provenance, atomic, provenance, read_bytes, seal};
use crate::error::{Error, Result};
use crate::tensor::NamedTensor;
use safetensors::SafeTensors;
use safetensors::tensor::{Dtype, TensorView};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::HashMap;
use std::path::Path;

/// The kind of a checkpoint of training; every other kind is a network's.
pub const CHECKPOINT: &str = "checkpoint";

/// Bytes of a number.
const F32_BYTES: usize = size_of::<f32>();

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    kind: String,
    meta: Value,
    order: Vec<String>,
    provenance: Value,
    seal: String,
}

/// Writes weights of a `kind` ("policy", "dynamics" or [`CHECKPOINT`]) with `meta`, all that is needed to run them.
///
/// # Errors
/// As [`encode`]; [`Error::Io`] when the system refuses.
pub fn write(path: &Path, kind: &str, tensors: &[NamedTensor], meta: &Value, provenance: &Provenance) -> Result<()> {
    atomic::write_bytes(path, &encode(path, kind, tensors, meta, provenance)?)
}

/// The bytes of the file that [`write()`] writes to `path`.
///
/// # Errors
/// [`Error::Input`] when a tensor's length does not fit its shape, two share a name, or a number is not finite.
pub fn encode(path: &Path, kind: &str, tensors: &[NamedTensor], meta: &Value, provenance: &Provenance) -> Result<Vec<u8>> {
    for (i, tensor) in tensors.iter().enumerate() {
        let expected: usize = tensor.shape.iter().product();
        if tensor.data.len() != expected {
            let message = format!("{} has shape {:?} but {} numbers", tensor.name, tensor.shape, tensor.data.len());
            return Err(Error::input(path, message));
        }
        if tensors[..i].iter().any(|t| t.name == tensor.name) {
            return Err(Error::input(path, format!("two tensors are named {}", tensor.name)));
        }
        check_finite(path, &tensor.name, &tensor.data)?;
    }
    let header = Header {
        kind: kind.into(),
        meta: meta.clone(),
        order: tensors.iter().map(|t| t.name.clone()).collect(),
        provenance: serde_json::to_value(provenance).expect("a provenance has string keys only"),
        seal: seal::blank(),
    };
    let header = serde_json::to_string(&header).expect("a header has string keys only");
    let bytes: Vec<Vec<u8>> = tensors.iter().map(|t| t.data.iter().flat_map(|v| v.to_le_bytes()).collect()).collect();
    let cannot = |e| Error::input(path, format!("cannot be encoded as safetensors: {e}"));
    let views = tensors.iter().zip(&bytes).map(|(t, b)| Ok((&t.name, TensorView::new(Dtype::F32, t.shape.clone(), b)?)));
    let views = views.collect::<std::result::Result<Vec<_>, _>>().map_err(cannot)?;
    let metadata = HashMap::from([(provenance::KEY.to_string(), header)]);
    let file = safetensors::serialize(views, Some(metadata)).map_err(cannot)?;
    Ok(seal::close(file))
}

/// Reads weights of a `kind`, in the order they were written.
///
/// # Errors
/// [`Error::Input`] when the file is cut short, damaged, foreign, of another kind or schema version, or holds a number that is not
/// finite; [`Error::Io`] when it cannot be read at all.
pub fn read(path: &Path, kind: &str) -> Result<(Vec<NamedTensor>, Value, Provenance)> {
    read_hashed(path, kind).map(|(tensors, meta, provenance, _)| (tensors, meta, provenance))
}

/// As [`read`], with the hash of the bytes that were read.
///
/// # Errors
/// As [`read`].
pub fn read_hashed(path: &Path, kind: &str) -> Result<(Vec<NamedTensor>, Value, Provenance, ContentHash)> {
    let bytes = read_bytes(path)?;
    let (found, tensors, meta, provenance) = decode(path, &bytes)?;
    if found != kind {
        return Err(Error::input(path, format!("holds the weights of a {}, a {} is needed", named(&found), named(kind))));
    }
    Ok((tensors, meta, provenance, ContentHash::of(&bytes)))
}

fn named(kind: &str) -> String {
    if kind == CHECKPOINT { "checkpoint of training".into() } else { format!("{kind} network") }
}

/// As [`read`], of any kind; the kind comes first.
pub(super) fn read_any(path: &Path) -> Result<(String, Vec<NamedTensor>, Value, Provenance)> {
    decode(path, &read_bytes(path)?)
}

fn decode(path: &Path, bytes: &[u8]) -> Result<(String, Vec<NamedTensor>, Value, Provenance)> {
    let invalid = |e| Error::input(path, format!("is no whole safetensors file: {e}"));
    let file = SafeTensors::deserialize(bytes).map_err(invalid)?;
    let (_, metadata) = SafeTensors::read_metadata(bytes).map_err(invalid)?;
    let header = metadata.metadata().as_ref().and_then(|m| m.get(provenance::KEY));
    let header = header.ok_or_else(|| Error::input(path, "was not written by hilt: its header has no \"hilt\" key"))?;
    let header: Header =
        serde_json::from_str(header).map_err(|e| Error::input(path, format!("its header cannot be read: {e}")))?;
    let provenance = Provenance::from_value(path, header.provenance)?;
    let tensors = header.order.iter().map(|name| tensor(path, &file, name)).collect::<Result<Vec<_>>>()?;
    seal::check(path, bytes)?;
    Ok((header.kind, tensors, header.meta, provenance))
}

fn tensor(path: &Path, file: &SafeTensors, name: &str) -> Result<NamedTensor> {
    let view = file.tensor(name).map_err(|e| Error::input(path, format!("{name}: {e}")))?;
    if view.dtype() != Dtype::F32 {
        return Err(Error::input(path, format!("{name} is of type {:?}, hilt reads F32", view.dtype())));
    }
    let word = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    let data: Vec<f32> = view.data().chunks_exact(F32_BYTES).map(word).collect();
    check_finite(path, name, &data)?;
    Ok(NamedTensor { name: name.into(), shape: view.shape().to_vec(), data })
}

fn check_finite(path: &Path, name: &str, data: &[f32]) -> Result<()> {
    match data.iter().position(|v| !v.is_finite()) {
        Some(at) => Err(Error::input(path, format!("{name}: number {at} is {}, weights must be finite", data[at]))),
        None => Ok(()),
    }
}
