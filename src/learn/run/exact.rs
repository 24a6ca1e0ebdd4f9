//! f64 in JSON, every bit of it: JSON has no NaN and no infinity, and a NaN has a sign that a table's bytes show. Finite numbers
//! stay numbers, the others become their bits in hexadecimal.

use serde::{Deserialize, Deserializer, Serializer, de};

/// Hexadecimal digits of the bits, and the mark before them.
const MARK: &str = "0x";
const RADIX: u32 = 16;

#[derive(Deserialize)]
#[serde(untagged)]
enum Written {
    Number(f64),
    Bits(String),
}

/// As a number, or as text.
pub fn serialize<S: Serializer>(value: &f64, to: S) -> Result<S::Ok, S::Error> {
    if value.is_finite() { to.serialize_f64(*value) } else { to.serialize_str(&format!("{MARK}{:x}", value.to_bits())) }
}

/// The inverse of [`serialize`].
pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    match Written::deserialize(from)? {
        Written::Number(value) => Ok(value),
        Written::Bits(text) => {
            let bits = text.strip_prefix(MARK).and_then(|digits| u64::from_str_radix(digits, RADIX).ok());
            bits.map(f64::from_bits).ok_or_else(|| de::Error::custom(format!("\"{text}\" is no number")))
        }
    }
}

#[cfg(test)]
mod tests {
    use serde::{Deserialize, Serialize};

    #[derive(Serialize, Deserialize)]
    struct One(#[serde(with = "super")] f64);

    #[test]
    fn every_bit_survives() {
        for value in [0.0, -0.0, 0.1, 1.0 / 3.0, 5e-324, f64::MAX, f64::NAN, -f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let text = serde_json::to_string(&One(value)).expect("text");
            let back: One = serde_json::from_str(&text).expect("a number");
            assert_eq!(back.0.to_bits(), value.to_bits(), "{text}");
        }
        assert!(serde_json::from_str::<One>("\"many\"").is_err());
    }
}
