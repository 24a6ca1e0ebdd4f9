//! Arrays of numbers as NumPy has them: a type, a shape, little-endian bytes.

use std::borrow::Cow;

/// More dimensions have no use here.
const MOST_DIMENSIONS: usize = 8;

/// Types of numbers that are taken. Objects, text, structures and the other byte order are none of them: nothing is ever unpickled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dtype {
    /// `|b1`
    Bool,
    /// `|i1`
    I8,
    /// `|u1`
    U8,
    /// `<i2`
    I16,
    /// `<u2`
    U16,
    /// `<i4`
    I32,
    /// `<u4`
    U32,
    /// `<i8`
    I64,
    /// `<u8`
    U64,
    /// `<f4`
    F32,
    /// `<f8`
    F64,
}

impl Dtype {
    const ALL: [(&'static str, Dtype, usize); 11] = [
        ("|b1", Dtype::Bool, 1),
        ("|i1", Dtype::I8, 1),
        ("|u1", Dtype::U8, 1),
        ("<i2", Dtype::I16, 2),
        ("<u2", Dtype::U16, 2),
        ("<i4", Dtype::I32, 4),
        ("<u4", Dtype::U32, 4),
        ("<i8", Dtype::I64, 8),
        ("<u8", Dtype::U64, 8),
        ("<f4", Dtype::F32, 4),
        ("<f8", Dtype::F64, 8),
    ];

    fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(known, ..)| *known == name).map(|(_, dtype, _)| *dtype)
    }

    /// NumPy's name of it.
    pub fn name(self) -> &'static str {
        Self::ALL[self as usize].0
    }

    /// Bytes of a number.
    fn size(self) -> usize {
        Self::ALL[self as usize].2
    }
}

/// An array whose bytes are as many as its type and shape say.
#[derive(Clone, Debug, PartialEq)]
pub struct Array<'a> {
    dtype: Dtype,
    shape: Vec<usize>,
    data: Cow<'a, [u8]>,
}

impl<'a> Array<'a> {
    /// Checks the parts that somebody sent.
    ///
    /// # Errors
    /// Says which types there are, or both sizes.
    pub fn new(dtype: &str, shape: Vec<usize>, data: &'a [u8]) -> Result<Self, String> {
        let Some(known) = Dtype::named(dtype) else {
            let names = Dtype::ALL.map(|(name, ..)| name).join(", ");
            return Err(format!("an array of type {}: allowed are {names}", crate::words::shown(dtype)));
        };
        if shape.len() > MOST_DIMENSIONS {
            return Err(format!("an array of {} dimensions; at most {MOST_DIMENSIONS} are taken", shape.len()));
        }
        let bytes = shape.iter().try_fold(known.size(), |bytes, length| bytes.checked_mul(*length));
        if bytes != Some(data.len()) {
            return Err(format!("an array of type {dtype} and shape {shape:?} in {} bytes: they do not fit", data.len()));
        }
        Ok(Array { dtype: known, shape, data: Cow::Borrowed(data) })
    }

    /// Of single precision.
    ///
    /// # Panics
    /// When there are not as many numbers as the shape says.
    pub fn f32(shape: &[usize], numbers: &[f32]) -> Array<'static> {
        assert_eq!(shape.iter().product::<usize>(), numbers.len(), "numbers of an array of shape {shape:?}");
        let data = numbers.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        Array { dtype: Dtype::F32, shape: shape.to_vec(), data: Cow::Owned(data) }
    }

    /// Length along each dimension.
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// Type of the numbers.
    pub fn dtype(&self) -> Dtype {
        self.dtype
    }

    /// The numbers, row-major.
    pub fn bytes(&self) -> &[u8] {
        &self.data
    }

    /// How many numbers there are.
    pub fn len(&self) -> usize {
        self.data.len() / self.dtype.size()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.data.is_empty()
    }

    /// The numbers in single precision, row-major.
    pub fn to_f32(&self) -> Vec<f32> {
        fn all<const N: usize>(bytes: &[u8], of: impl Fn([u8; N]) -> f32) -> Vec<f32> {
            bytes.as_chunks().0.iter().map(|b| of(*b)).collect()
        }
        let bytes = &self.data[..];
        match self.dtype {
            Dtype::Bool => all(bytes, |[b]| f32::from(u8::from(b != 0))),
            Dtype::I8 => all(bytes, |b| f32::from(i8::from_le_bytes(b))),
            Dtype::U8 => all(bytes, |[b]| f32::from(b)),
            Dtype::I16 => all(bytes, |b| f32::from(i16::from_le_bytes(b))),
            Dtype::U16 => all(bytes, |b| f32::from(u16::from_le_bytes(b))),
            Dtype::I32 => all(bytes, |b| i32::from_le_bytes(b) as f32),
            Dtype::U32 => all(bytes, |b| u32::from_le_bytes(b) as f32),
            Dtype::I64 => all(bytes, |b| i64::from_le_bytes(b) as f32),
            Dtype::U64 => all(bytes, |b| u64::from_le_bytes(b) as f32),
            Dtype::F32 => all(bytes, f32::from_le_bytes),
            Dtype::F64 => all(bytes, |b| f64::from_le_bytes(b) as f32),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_type_is_read_and_no_other() {
        for (at, (name, dtype, size)) in Dtype::ALL.into_iter().enumerate() {
            assert_eq!((dtype as usize, dtype.name(), dtype.size()), (at, name, size));
            let mut one = vec![0; size];
            match dtype {
                Dtype::F32 => one.copy_from_slice(&1f32.to_le_bytes()),
                Dtype::F64 => one.copy_from_slice(&1f64.to_le_bytes()),
                _ => one[0] = 1,
            }
            assert_eq!(Array::new(name, vec![1], &one).expect(name).to_f32(), [1.0], "{name}");
        }
        for name in ["|O", "O", ">f4", "<f2", "<c8", "|S4", "<U4", "|V8", "<M8[s]", "", "f4"] {
            let refused = Array::new(name, vec![1], &[0; 4]).expect_err(name);
            assert!(refused.contains("allowed are |b1"), "{refused}");
        }
    }

    #[test]
    fn a_shape_fits_its_bytes() {
        assert_eq!(Array::new("<f4", vec![2, 3], &[0; 24]).expect("fits").len(), 6);
        for shape in [vec![2, 2], vec![usize::MAX, 2], vec![usize::MAX, usize::MAX, 0, 8], vec![], vec![1; 9]] {
            assert!(Array::new("<f4", shape.clone(), &[0; 24]).is_err(), "{shape:?}");
        }
    }
}
