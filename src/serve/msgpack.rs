//! msgpack with NumPy's arrays as openpi packs them: maps with the keys `__ndarray__`, `data`, `dtype` and `shape`, and scalars as maps with
//! `__npgeneric__`.

use super::array::Array;
use super::value::Value;
use rmp::Marker;
use rmp::decode::{RmpRead, read_marker};
use rmp::encode;
use std::borrow::Cow;
use std::str;

/// Values of a message, all that is nested counted: an observation has some tens.
const MOST_VALUES: usize = 1 << 16;
/// Lists and maps inside each other.
const MOST_DEPTH: usize = 16;

const ARRAY: &str = "__ndarray__";
const SCALAR: &str = "__npgeneric__";

/// The one value of a message.
///
/// # Errors
/// Says what is wrong with the bytes, or which limit they pass. Memory is taken by what is there, not by what a length promises.
pub fn decode(bytes: &[u8]) -> Result<Value<'_>, String> {
    let mut reader = Reader { rest: bytes, left: MOST_VALUES };
    let value = reader.value(MOST_DEPTH)?;
    match reader.rest.len() {
        0 => Ok(value),
        more => Err(format!("{more} bytes more than the message has")),
    }
}

struct Reader<'a> {
    rest: &'a [u8],
    /// Values that may still come.
    left: usize,
}

fn cut<E>(_: E) -> String {
    "the message is cut short".into()
}

impl<'a> Reader<'a> {
    fn value(&mut self, depth: usize) -> Result<Value<'a>, String> {
        self.left = self.left.checked_sub(1).ok_or_else(|| format!("more than {MOST_VALUES} values in one message"))?;
        let marker = read_marker(&mut self.rest).map_err(cut)?;
        let rest = &mut self.rest;
        Ok(match marker {
            Marker::Null => Value::Nil,
            Marker::True => Value::Bool(true),
            Marker::False => Value::Bool(false),
            Marker::FixPos(v) => Value::Int(v.into()),
            Marker::FixNeg(v) => Value::Int(v.into()),
            Marker::U8 => Value::Int(rest.read_data_u8().map_err(cut)?.into()),
            Marker::U16 => Value::Int(rest.read_data_u16().map_err(cut)?.into()),
            Marker::U32 => Value::Int(rest.read_data_u32().map_err(cut)?.into()),
            Marker::U64 => {
                let whole = rest.read_data_u64().map_err(cut)?;
                i64::try_from(whole).map_or(Value::Float(whole as f64), Value::Int)
            }
            Marker::I8 => Value::Int(rest.read_data_i8().map_err(cut)?.into()),
            Marker::I16 => Value::Int(rest.read_data_i16().map_err(cut)?.into()),
            Marker::I32 => Value::Int(rest.read_data_i32().map_err(cut)?.into()),
            Marker::I64 => Value::Int(rest.read_data_i64().map_err(cut)?),
            Marker::F32 => Value::Float(rest.read_data_f32().map_err(cut)?.into()),
            Marker::F64 => Value::Float(rest.read_data_f64().map_err(cut)?),
            _ => return self.sized(marker, depth),
        })
    }

    /// What begins with a length.
    fn sized(&mut self, marker: Marker, depth: usize) -> Result<Value<'a>, String> {
        let length = match marker {
            Marker::FixStr(n) | Marker::FixArray(n) | Marker::FixMap(n) => u32::from(n),
            Marker::Str8 | Marker::Bin8 => self.rest.read_data_u8().map_err(cut)?.into(),
            Marker::Str16 | Marker::Bin16 | Marker::Array16 | Marker::Map16 => self.rest.read_data_u16().map_err(cut)?.into(),
            Marker::Str32 | Marker::Bin32 | Marker::Array32 | Marker::Map32 => self.rest.read_data_u32().map_err(cut)?,
            Marker::Reserved => return Err("the byte 0xc1, which msgpack does not have".into()),
            _ => return Err("a type of msgpack's extensions; none is taken".into()),
        } as usize;
        match marker {
            Marker::FixStr(_) | Marker::Str8 | Marker::Str16 | Marker::Str32 => {
                let text = str::from_utf8(self.bytes(length)?).map_err(|_| "text that is no UTF-8")?;
                Ok(Value::text(text))
            }
            Marker::Bin8 | Marker::Bin16 | Marker::Bin32 => Ok(Value::Bytes(self.bytes(length)?)),
            Marker::FixArray(_) | Marker::Array16 | Marker::Array32 => {
                let depth = self.deeper(length, depth)?;
                (0..length).map(|_| self.value(depth)).collect::<Result<_, _>>().map(Value::List)
            }
            _ => {
                let depth = self.deeper(length, depth)?;
                let entries = (0..length).map(|_| Ok((self.key()?, self.value(depth)?))).collect::<Result<_, String>>()?;
                numpy(entries)
            }
        }
    }

    fn bytes(&mut self, length: usize) -> Result<&'a [u8], String> {
        let (bytes, rest) = self.rest.split_at_checked(length).ok_or_else(|| cut(()))?;
        self.rest = rest;
        Ok(bytes)
    }

    /// Into a list or a map of so many: each has at least a byte.
    fn deeper(&self, length: usize, depth: usize) -> Result<usize, String> {
        if length > self.rest.len() {
            return Err(cut(()));
        }
        depth.checked_sub(1).ok_or_else(|| format!("more than {MOST_DEPTH} lists or maps inside each other"))
    }

    /// A name, as text or, as openpi's arrays have theirs, as bytes.
    fn key(&mut self) -> Result<Cow<'a, str>, String> {
        // Nothing can be nested in a key.
        match self.value(0)? {
            Value::Text(text) => Ok(text),
            Value::Bytes(bytes) => str::from_utf8(bytes).map(Cow::Borrowed).map_err(|_| "a key that is no UTF-8".into()),
            other => Err(format!("{} as the key of a map; keys are text", other.kind())),
        }
    }
}

/// A map, or what of NumPy's it stands for.
fn numpy<'a>(entries: Vec<(Cow<'a, str>, Value<'a>)>) -> Result<Value<'a>, String> {
    let map = Value::Map(entries);
    if map.get(ARRAY).is_some() {
        let (Some(Value::Bytes(data)), Some(dtype)) = (map.get("data"), map.get("dtype").and_then(Value::as_text)) else {
            return Err("an array without \"data\" in bytes or \"dtype\" as text".into());
        };
        let Some(Value::List(shape)) = map.get("shape") else { return Err("an array without a list as its \"shape\"".into()) };
        let lengths = shape.iter().map(|v| v.as_u64().and_then(|n| usize::try_from(n).ok())).collect::<Option<_>>();
        return Array::new(dtype, lengths.ok_or("an array whose \"shape\" holds other than whole numbers")?, data)
            .map(Value::Array);
    }
    if map.get(SCALAR).is_some() {
        return match map.get("data") {
            Some(number @ (Value::Bool(_) | Value::Int(_) | Value::Float(_))) => Ok(number.clone()),
            _ => Err("a NumPy scalar without a number as its \"data\"".into()),
        };
    }
    Ok(map)
}

/// The bytes of a value.
pub fn encode(value: &Value) -> Vec<u8> {
    let mut out = Vec::new();
    write(&mut out, value);
    out
}

/// Lengths of what hilt sends are those of rows and names.
fn length(n: usize) -> u32 {
    u32::try_from(n).expect("a message is smaller than 4 GiB")
}

fn write(out: &mut Vec<u8>, value: &Value) {
    const NEVER: &str = "memory takes all bytes";
    match value {
        Value::Nil => encode::write_nil(out).expect(NEVER),
        Value::Bool(flag) => encode::write_bool(out, *flag).expect(NEVER),
        Value::Int(number) => drop(encode::write_sint(out, *number).expect(NEVER)),
        Value::Float(number) => encode::write_f64(out, *number).expect(NEVER),
        Value::Text(text) => encode::write_str(out, text).expect(NEVER),
        Value::Bytes(bytes) => encode::write_bin(out, bytes).expect(NEVER),
        Value::List(list) => {
            encode::write_array_len(out, length(list.len())).expect(NEVER);
            list.iter().for_each(|value| write(out, value));
        }
        Value::Map(entries) => {
            encode::write_map_len(out, length(entries.len())).expect(NEVER);
            for (name, value) in entries {
                encode::write_str(out, name).expect(NEVER);
                write(out, value);
            }
        }
        Value::Array(array) => {
            encode::write_map_len(out, 4).expect(NEVER);
            let mut entry = |name: &str, value: Value| {
                encode::write_bin(out, name.as_bytes()).expect(NEVER);
                write(out, &value);
            };
            entry(ARRAY, Value::Bool(true));
            entry("data", Value::Bytes(array.bytes()));
            entry("dtype", Value::text(array.dtype().name()));
            entry("shape", Value::List(array.shape().iter().map(|n| Value::Int(i64::from(length(*n)))).collect()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `msgpack_numpy.packb({"a": np.array([1.5, -2], np.float32), "n": np.float32(0.5), "t": ["x", None, -7, 300]})` of openpi-client.
    const OPENPI: &[u8] = b"\x83\xa1a\x84\xc4\x0b__ndarray__\xc3\xc4\x04data\xc4\x08\x00\x00\xc0?\x00\x00\x00\xc0\xc4\x05dtype\xa3<f4\xc4\x05shape\x91\x02\
        \xa1n\x83\xc4\x0d__npgeneric__\xc3\xc4\x04data\xcb?\xe0\x00\x00\x00\x00\x00\x00\xc4\x05dtype\xa3<f4\xa1t\x94\xa1x\xc0\xf9\xcd\x01,";

    #[test]
    fn what_openpi_packs_is_read_and_packed_alike() {
        let value = decode(OPENPI).expect("a message");
        let array = Array::f32(&[2], &[1.5, -2.0]);
        assert_eq!(value.get("a"), Some(&Value::Array(array.clone())));
        assert_eq!(value.get("n"), Some(&Value::Float(0.5)));
        let list = Value::List(vec![Value::text("x"), Value::Nil, Value::Int(-7), Value::Int(300)]);
        assert_eq!(value.get("t"), Some(&list));
        let bytes = encode(&Value::map([("a", Value::Array(array))]));
        assert_eq!(bytes[1..], OPENPI[1..bytes.len()]);
    }

    #[test]
    fn values_come_back_from_their_bytes() {
        let value = Value::map([
            ("nothing", Value::Nil),
            ("flags", Value::List(vec![Value::Bool(true), Value::Bool(false)])),
            ("numbers", Value::List([i64::MIN, -129, -1, 0, 127, 128, 65536, i64::MAX].map(Value::Int).to_vec())),
            ("pi", Value::Float(std::f64::consts::PI)),
            ("text", Value::text("é".repeat(300))),
            ("bytes", Value::Bytes(&[7; 70000])),
            ("array", Value::Array(Array::f32(&[3, 1], &[1.0, f32::INFINITY, -0.0]))),
        ]);
        assert_eq!(decode(&encode(&value)).as_ref(), Ok(&value));
        let whole = encode(&value);
        for end in (0..400).chain(whole.len() - 100..whole.len()) {
            assert!(decode(&whole[..end]).is_err(), "cut at {end}");
        }
    }

    #[test]
    fn limits_hold_whatever_a_length_promises() {
        let refused = |bytes: &[u8]| decode(bytes).expect_err("refused");
        assert!(refused(&[0xdd, 0xff, 0xff, 0xff, 0xff, 0xc0]).contains("cut short"));
        assert!(refused(&[0xdf, 0xff, 0xff, 0xff, 0xff, 0xc0]).contains("cut short"));
        assert!(refused(&[0xc6, 0xff, 0xff, 0xff, 0xff, 0xc0]).contains("cut short"));
        assert!(refused(&[0x91; 1000]).contains("more than 16 lists or maps"));
        let mut many = vec![0xdd, 0, 2, 0, 0];
        many.extend(vec![0xc0; 1 << 17]);
        assert!(refused(&many).contains("more than 65536 values"));
        assert!(refused(b"\x81\x81\x01\x02\x03").contains("inside each other"));
        assert!(refused(b"\x81\x01\x02").contains("as the key"));
        assert!(refused(b"\xd4\x00\x00").contains("extensions"));
        assert!(refused(b"\xc1").contains("0xc1"));
        assert!(refused(b"\xc0\xc0").contains("1 bytes more"));
        assert!(refused(b"").contains("cut short"));
        // A pickled object, as numpy would have it.
        let object = b"\x84\xc4\x0b__ndarray__\xc3\xc4\x04data\xc4\x01.\xc4\x05dtype\xa2|O\xc4\x05shape\x91\x01";
        assert!(refused(object).contains("type |O: allowed"), "{}", refused(object));
    }
}
