//! Network weights as safetensors. The header's only metadata key, `hilt`, holds JSON: kind, what is needed to run the network,
//! the tensors' order, provenance and seal.

use super::bytes::{Ends, Format};
use super::{ContentHash, Provenance, atomic, json_text, provenance, seal};
use crate::error::{Error, Result};
use crate::guard::guarded;
use crate::tensor::NamedTensor;
use crate::words::shown;
use safetensors::SafeTensors;
use safetensors::tensor::{Dtype, Metadata, TensorView};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::{BTreeSet, HashMap};
use std::path::Path;

/// The kind of a checkpoint of training; every other kind is a network's.
pub const CHECKPOINT: &str = "checkpoint";
/// Kind of the weights that `hilt pretrain` writes.
pub const DYNAMICS: &str = "dynamics";
/// Kind of the weights that `hilt train` writes.
pub const POLICY: &str = "policy";

/// Bytes of a number.
const F32_BYTES: usize = size_of::<f32>();
/// Bytes of the header's length, which comes first.
const LENGTH_BYTES: usize = size_of::<u64>();
/// A longer header is refused: that of a checkpoint after 75,000 epochs, a line of metrics each, has so much.
const MOST_HEADER_BYTES: u64 = 64 << 20;
/// The metadata come first in the header; this key is theirs.
const METADATA_KEY: &[u8] = b"\"hilt\"";

/// What weights look like from outside.
const FORMAT: Format = Format {
    most_bytes: 640 << 20,
    reason: "a checkpoint of the largest networks that settings allow has some 590 MB",
    head: check_head,
    ends: check_ends,
};

fn check_head(path: &Path, head: &[u8]) -> Result<()> {
    let header = head.get(LENGTH_BYTES..).unwrap_or_default();
    if !header.starts_with(b"{") {
        return Err(Error::input(path, "is no safetensors file; expected weights of hilt pretrain or hilt train"));
    }
    if !header.windows(METADATA_KEY.len()).any(|part| part == METADATA_KEY) {
        return Err(Error::input(path, "was not written by hilt: its header has no \"hilt\" key"));
    }
    Ok(())
}

fn check_ends(path: &Path, ends: &Ends) -> Result<()> {
    let length = ends.at(path, 0, LENGTH_BYTES)?;
    let length = length.first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes));
    if length > MOST_HEADER_BYTES {
        return Err(Error::input(path, format!("its header has {length} bytes, hilt reads at most {MOST_HEADER_BYTES}")));
    }
    let (whole, found) = (LENGTH_BYTES as u64 + length, ends.len());
    if whole > found {
        return Err(Error::input(path, format!("is cut short: its header ends at byte {whole}, the file at {found}")));
    }
    Ok(())
}

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
    let bytes = FORMAT.read(path)?;
    let (found, tensors, meta, provenance) = decode(path, &bytes)?;
    if found != kind {
        return Err(Error::input(path, format!("holds the weights of a {}, a {} is needed", named(&found), named(kind))));
    }
    Ok((tensors, meta, provenance, ContentHash::of(&bytes)))
}

fn named(kind: &str) -> String {
    if kind == CHECKPOINT { "checkpoint of training".into() } else { format!("{} network", shown(kind)) }
}

/// As [`read`], of any kind; the kind comes first.
pub(super) fn read_any(path: &Path) -> Result<(String, Vec<NamedTensor>, Value, Provenance)> {
    decode(path, &FORMAT.read(path)?)
}

/// Kind, tensors, description and provenance in the bytes of the file at `path`.
///
/// # Errors
/// [`Error::Input`] as [`read`].
pub fn decode(path: &Path, bytes: &[u8]) -> Result<(String, Vec<NamedTensor>, Value, Provenance)> {
    FORMAT.check(path, bytes)?;
    seal::check(path, bytes).map_err(|why| no_number(path, bytes).unwrap_or(why))?;
    guarded(|| decode_sealed(path, bytes)).unwrap_or_else(|why| Err(Error::input(path, format!("damaged: {why}"))))
}

fn decode_sealed(path: &Path, bytes: &[u8]) -> Result<(String, Vec<NamedTensor>, Value, Provenance)> {
    let invalid = |e| Error::input(path, format!("is no whole safetensors file: {}", shown(&format!("{e}"))));
    let (header_bytes, metadata) = SafeTensors::read_metadata(bytes).map_err(invalid)?;
    let header = metadata.metadata().as_ref().and_then(|m| m.get(provenance::KEY));
    let header = header.ok_or_else(|| Error::input(path, "was not written by hilt: its header has no \"hilt\" key"))?;
    let unreadable = |why| Error::input(path, format!("its header cannot be read: {why}"));
    let header: Header = json_text::parse(header.as_bytes()).map_err(unreadable)?;
    let provenance = Provenance::from_value(path, header.provenance)?;
    let (names, all) = (header.order.iter().collect::<BTreeSet<_>>().len(), metadata.offset_keys().len());
    if names != header.order.len() || names != all {
        let message = format!("its order has {} names, {names} of them different, for {all} tensors", header.order.len());
        return Err(Error::input(path, message));
    }
    let data = &bytes[LENGTH_BYTES + header_bytes..];
    let tensors = header.order.iter().map(|name| tensor(path, &metadata, data, name)).collect::<Result<Vec<_>>>()?;
    Ok((header.kind, tensors, header.meta, provenance))
}

/// What is wrong with a file that was changed so that it holds numbers that are none: worth more than that it was changed.
fn no_number(path: &Path, bytes: &[u8]) -> Option<Error> {
    let length = bytes.first_chunk().map(|bytes| u64::from_le_bytes(*bytes))?;
    let (numbers, _) = bytes.get(LENGTH_BYTES + length as usize..)?.as_chunks();
    let mut numbers = numbers.iter().map(|b| f32::from_le_bytes(*b)).enumerate();
    let (at, found) = numbers.find(|(_, v)| !v.is_finite())?;
    Some(Error::input(path, format!("was changed after it was written: number {at} is {found}, weights must be finite")))
}

fn tensor(path: &Path, metadata: &Metadata, data: &[u8], name: &str) -> Result<NamedTensor> {
    let shown = shown(name);
    let info = metadata.info(name).ok_or_else(|| Error::input(path, format!("tensor {shown} is missing")))?;
    if info.dtype != Dtype::F32 {
        return Err(Error::input(path, format!("{shown} is of type {:?}, hilt reads F32", info.dtype)));
    }
    let bytes = data.get(info.data_offsets.0..info.data_offsets.1);
    let bytes = bytes.ok_or_else(|| Error::input(path, format!("{shown} lies behind the end of the file")))?;
    let (words, _) = bytes.as_chunks::<F32_BYTES>();
    let data: Vec<f32> = words.iter().map(|word| f32::from_le_bytes(*word)).collect();
    check_finite(path, &shown, &data)?;
    Ok(NamedTensor { name: name.into(), shape: info.shape.clone(), data })
}

fn check_finite(path: &Path, name: &str, data: &[f32]) -> Result<()> {
    match data.iter().position(|v| !v.is_finite()) {
        Some(at) => Err(Error::input(path, format!("{name}: number {at} is {}, weights must be finite", data[at]))),
        None => Ok(()),
    }
}
