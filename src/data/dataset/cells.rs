//! The numbers of a column: their type, and how they become bytes, Arrow columns and keys that sort as they do.

use arrow_array::{ArrayRef, BooleanArray, FixedSizeListArray, Float32Array, Float64Array, Int64Array};
use arrow_schema::Field;
use std::ops::Range;
use std::sync::Arc;

/// Type of a column's numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    F32,
    F64,
    I64,
    Bool,
}

impl Kind {
    /// LeRobot's name of it.
    pub(super) fn dtype(self) -> &'static str {
        match self {
            Kind::F32 => "float32",
            Kind::F64 => "float64",
            Kind::I64 => "int64",
            Kind::Bool => "bool",
        }
    }

    /// The number of a key of [`Cells::for_each`].
    pub(super) fn value(self, key: u64) -> f64 {
        match self {
            Kind::F32 => f64::from(f32::from_bits(if key & F32_SIGN == 0 { !(key as u32) } else { (key ^ F32_SIGN) as u32 })),
            Kind::F64 => f64::from_bits(if key & I64_SIGN == 0 { !key } else { key ^ I64_SIGN }),
            Kind::I64 => (key ^ I64_SIGN) as i64 as f64,
            Kind::Bool => key as f64,
        }
    }
}

/// Bits of the sign.
const F32_SIGN: u64 = 1 << 31;
const I64_SIGN: u64 = 1 << 63;

/// Values of a column, row-major.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Cells {
    F32(Vec<f32>),
    F64(Vec<f64>),
    I64(Vec<i64>),
    Bool(Vec<bool>),
}

impl Cells {
    /// As f64, flags as 0 and 1.
    pub(super) fn to_f64(&self) -> Vec<f64> {
        match self {
            Cells::F32(v) => v.iter().map(|x| f64::from(*x)).collect(),
            Cells::F64(v) => v.clone(),
            Cells::I64(v) => v.iter().map(|x| *x as f64).collect(),
            Cells::Bool(v) => v.iter().map(|x| f64::from(u8::from(*x))).collect(),
        }
    }

    /// Adds some of the values of others of the same kind; nothing of another kind.
    pub(super) fn extend_from(&mut self, others: &Cells, range: Range<usize>) {
        match (self, others) {
            (Cells::F32(to), Cells::F32(from)) => to.extend_from_slice(&from[range]),
            (Cells::F64(to), Cells::F64(from)) => to.extend_from_slice(&from[range]),
            (Cells::I64(to), Cells::I64(from)) => to.extend_from_slice(&from[range]),
            (Cells::Bool(to), Cells::Bool(from)) => to.extend_from_slice(&from[range]),
            _ => debug_assert!(false, "columns of two kinds"),
        }
    }

    /// Number of values.
    pub(super) fn len(&self) -> usize {
        match self {
            Cells::F32(v) => v.len(),
            Cells::F64(v) => v.len(),
            Cells::I64(v) => v.len(),
            Cells::Bool(v) => v.len(),
        }
    }

    /// Shows every value, column by column, with its place in its row of `width` and with a key that sorts as the values do.
    pub(super) fn for_each(&self, width: usize, mut take: impl FnMut(usize, f64, u64)) {
        let key = |x: f32| u64::from(if x.is_sign_negative() { !x.to_bits() } else { x.to_bits() | F32_SIGN as u32 });
        let wide_key = |x: f64| if x.is_sign_negative() { !x.to_bits() } else { x.to_bits() | I64_SIGN };
        match self {
            Cells::F32(v) => by_column(v, width, |at, x| take(at, f64::from(x), key(x))),
            Cells::F64(v) => by_column(v, width, |at, x| take(at, x, wide_key(x))),
            Cells::I64(v) => by_column(v, width, |at, x| take(at, x as f64, x as u64 ^ I64_SIGN)),
            Cells::Bool(v) => by_column(v, width, |at, x| take(at, f64::from(u8::from(x)), u64::from(x))),
        }
    }

    /// Adds the values to `bytes`, which [`Cells::of_bytes`] reads.
    pub(super) fn push_bytes(&self, bytes: &mut Vec<u8>) {
        match self {
            Cells::F32(v) => v.iter().for_each(|x| bytes.extend(x.to_le_bytes())),
            Cells::F64(v) => v.iter().for_each(|x| bytes.extend(x.to_le_bytes())),
            Cells::I64(v) => v.iter().for_each(|x| bytes.extend(x.to_le_bytes())),
            Cells::Bool(v) => v.iter().for_each(|x| bytes.push(u8::from(*x))),
        }
    }

    /// The inverse of [`Cells::push_bytes`].
    pub(super) fn of_bytes(kind: Kind, bytes: &[u8]) -> Self {
        match kind {
            Kind::F32 => Cells::F32(bytes.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect()),
            Kind::F64 => Cells::F64(bytes.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect()),
            Kind::I64 => Cells::I64(bytes.as_chunks().0.iter().map(|b| i64::from_le_bytes(*b)).collect()),
            Kind::Bool => Cells::Bool(bytes.iter().map(|b| *b != 0).collect()),
        }
    }

    /// As an Arrow column of `width` numbers a row.
    pub(super) fn to_array(&self, width: usize) -> ArrayRef {
        let flat: ArrayRef = match self {
            Cells::F32(v) => Arc::new(Float32Array::from(v.clone())),
            Cells::F64(v) => Arc::new(Float64Array::from(v.clone())),
            Cells::I64(v) => Arc::new(Int64Array::from(v.clone())),
            Cells::Bool(v) => Arc::new(BooleanArray::from(v.clone())),
        };
        if width == 1 {
            return flat;
        }
        let item = Arc::new(Field::new_list_field(flat.data_type().clone(), true));
        Arc::new(FixedSizeListArray::new(item, width as i32, flat, None))
    }
}

/// One column after the other.
fn by_column<T: Copy>(values: &[T], width: usize, mut take: impl FnMut(usize, T)) {
    (0..width).for_each(|at| values.iter().skip(at).step_by(width).for_each(|x| take(at, *x)));
}
