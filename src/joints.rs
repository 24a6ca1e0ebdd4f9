//! One number for each driven joint of a robot.

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::ops::{Deref, DerefMut};

/// Most driven joints of a robot: an arm of seven and five fingers leave room.
pub const MOST_JOINTS: usize = 16;

/// A number for each joint, those of the arm first: a slice of up to [`MOST_JOINTS`] numbers, copied like an array.
#[derive(Clone, Copy, PartialEq)]
pub struct Joints {
    /// Zero behind `len`.
    values: [f64; MOST_JOINTS],
    len: usize,
}

impl Joints {
    /// `len` zeros.
    ///
    /// # Panics
    /// If there are more than [`MOST_JOINTS`].
    pub fn zeros(len: usize) -> Self {
        assert!(len <= MOST_JOINTS, "{len} joints; a robot has up to {MOST_JOINTS}");
        Joints { values: [0.0; MOST_JOINTS], len }
    }

    /// The number that `value` gives for each of `len` joints.
    ///
    /// # Panics
    /// As [`Joints::zeros`].
    pub fn from_fn(len: usize, value: impl FnMut(usize) -> f64) -> Self {
        let mut joints = Joints::zeros(len);
        joints.iter_mut().zip((0..len).map(value)).for_each(|(slot, value)| *slot = value);
        joints
    }

    /// Each number changed by `change`.
    pub fn map(self, mut change: impl FnMut(f64) -> f64) -> Self {
        Joints::from_fn(self.len, |i| change(self.values[i]))
    }

    /// As many as there are in `values`; `None` for more than a robot has.
    pub fn of(values: &[f64]) -> Option<Self> {
        (values.len() <= MOST_JOINTS).then(|| Joints::from_fn(values.len(), |i| values[i]))
    }
}

impl Deref for Joints {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.values[..self.len]
    }
}

impl DerefMut for Joints {
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.values[..self.len]
    }
}

impl fmt::Debug for Joints {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        (**self).fmt(f)
    }
}

impl FromIterator<f64> for Joints {
    /// # Panics
    /// As [`Joints::zeros`].
    fn from_iter<I: IntoIterator<Item = f64>>(values: I) -> Self {
        let mut joints = Joints::zeros(0);
        for value in values {
            assert!(joints.len < MOST_JOINTS, "a robot has up to {MOST_JOINTS} joints");
            joints.values[joints.len] = value;
            joints.len += 1;
        }
        joints
    }
}

impl<const N: usize> From<[f64; N]> for Joints {
    fn from(values: [f64; N]) -> Self {
        values.into_iter().collect()
    }
}

impl<'a> IntoIterator for &'a Joints {
    type Item = &'a f64;
    type IntoIter = std::slice::Iter<'a, f64>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl Serialize for Joints {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        (**self).serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Joints {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let values = Vec::<f64>::deserialize(deserializer)?;
        let refuse = || serde::de::Error::custom(format!("{} joints; a robot has up to {MOST_JOINTS}", values.len()));
        Joints::of(&values).ok_or_else(refuse)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joints_are_a_slice_of_their_own_length() {
        let joints: Joints = [1.0, 2.0, 3.0].into();
        assert_eq!((joints.len(), &joints[1..], joints.map(|v| 2.0 * v)), (3, &[2.0, 3.0][..], [2.0, 4.0, 6.0].into()));
        assert_ne!(joints, [1.0, 2.0, 3.0, 0.0].into());
        let text = serde_json::to_string(&joints).expect("numbers");
        assert_eq!((text.as_str(), serde_json::from_str::<Joints>(&text).expect("numbers")), ("[1.0,2.0,3.0]", joints));
        assert!(serde_json::from_str::<Joints>(&format!("{:?}", [0.0; MOST_JOINTS + 1])).is_err());
    }
}
