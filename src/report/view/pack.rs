//! Numbers as text within a page: little-endian bytes in base64.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

/// Single precision.
pub(super) fn f32s(values: impl IntoIterator<Item = f64>) -> String {
    STANDARD.encode(values.into_iter().flat_map(|v| (v as f32).to_le_bytes()).collect::<Vec<u8>>())
}

/// Shares of 1, as 16-bit numbers.
pub(super) fn shares_i16(values: impl IntoIterator<Item = f32>) -> String {
    let whole = |v: f32| (v.clamp(-1.0, 1.0) * f32::from(i16::MAX)).round() as i16;
    STANDARD.encode(values.into_iter().flat_map(|v| whole(v).to_le_bytes()).collect::<Vec<u8>>())
}

/// Shares of 1, as 8-bit numbers.
pub(super) fn shares_i8(values: impl IntoIterator<Item = f32>) -> String {
    let whole = |v: f32| (v.clamp(-1.0, 1.0) * f32::from(i8::MAX)).round() as i8;
    STANDARD.encode(values.into_iter().map(|v| whole(v) as u8).collect::<Vec<u8>>())
}

/// Whole numbers of 16 bits.
pub(super) fn u16s(values: impl IntoIterator<Item = u16>) -> String {
    STANDARD.encode(values.into_iter().flat_map(u16::to_le_bytes).collect::<Vec<u8>>())
}

/// Bytes.
pub(super) fn bytes(values: &[u8]) -> String {
    STANDARD.encode(values)
}
