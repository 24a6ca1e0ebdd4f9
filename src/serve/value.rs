//! What a message holds, however it came: msgpack or JSON.

use super::array::Array;
use serde_json::{Map, Value as Json};
use std::borrow::Cow;

/// A value of a message; borrows from the bytes that came.
#[derive(Clone, Debug, PartialEq)]
pub enum Value<'a> {
    /// Nothing.
    Nil,
    /// A flag.
    Bool(bool),
    /// A whole number.
    Int(i64),
    /// Another number.
    Float(f64),
    /// Text.
    Text(Cow<'a, str>),
    /// Bytes.
    Bytes(&'a [u8]),
    /// Values in a row.
    List(Vec<Value<'a>>),
    /// Values by name; the first of a name counts.
    Map(Vec<(Cow<'a, str>, Value<'a>)>),
    /// An array of NumPy's.
    Array(Array<'a>),
}

/// Numbers with their shape, row-major, in single precision.
#[derive(Clone, Debug, PartialEq)]
pub struct Numbers {
    /// Length along each dimension; none for a single number.
    pub shape: Vec<usize>,
    /// All of them.
    pub values: Vec<f32>,
}

impl<'a> Value<'a> {
    /// Text.
    pub fn text(text: impl Into<Cow<'a, str>>) -> Self {
        Value::Text(text.into())
    }

    /// A map.
    pub fn map<const N: usize>(entries: [(&'a str, Value<'a>); N]) -> Self {
        Value::Map(entries.into_iter().map(|(name, value)| (Cow::Borrowed(name), value)).collect())
    }

    /// Adds an entry to a map; nothing else has entries.
    pub fn insert(&mut self, name: &'a str, value: Value<'a>) {
        if let Value::Map(entries) = self {
            entries.push((Cow::Borrowed(name), value));
        }
    }

    /// The entry of this name, of a map.
    pub fn get(&self, name: &str) -> Option<&Value<'a>> {
        match self {
            Value::Map(entries) => entries.iter().find(|(key, _)| key == name).map(|(_, value)| value),
            _ => None,
        }
    }

    /// Text, where it is that.
    pub fn as_text(&self) -> Option<&str> {
        match self {
            Value::Text(text) => Some(text),
            _ => None,
        }
    }

    /// A whole number from 0, where it is that (an array of one such number, too).
    pub fn as_u64(&self) -> Option<u64> {
        match self {
            Value::Int(number) => u64::try_from(*number).ok(),
            Value::Array(array) if array.len() == 1 => {
                let number = array.to_f32()[0];
                // What single precision holds without a gap.
                (number.fract() == 0.0 && (0.0..=16_777_216.0).contains(&number)).then_some(number as u64)
            }
            _ => None,
        }
    }

    /// The kind of value, for messages.
    pub fn kind(&self) -> &'static str {
        match self {
            Value::Nil => "nothing",
            Value::Bool(_) => "a flag",
            Value::Int(_) | Value::Float(_) => "a number",
            Value::Text(_) => "text",
            Value::Bytes(_) => "bytes",
            Value::List(_) => "a list",
            Value::Map(_) => "a map",
            Value::Array(_) => "an array",
        }
    }

    /// All numbers of an array, or of a list of numbers or of equally long lists.
    ///
    /// # Errors
    /// Says what else it holds.
    pub fn numbers(&self) -> Result<Numbers, String> {
        match self {
            Value::Bool(flag) => Ok(Numbers { shape: vec![], values: vec![f32::from(u8::from(*flag))] }),
            Value::Int(number) => Ok(Numbers { shape: vec![], values: vec![*number as f32] }),
            Value::Float(number) => Ok(Numbers { shape: vec![], values: vec![*number as f32] }),
            Value::Array(array) => Ok(Numbers { shape: array.shape().to_vec(), values: array.to_f32() }),
            // JSON has no other word for NaN.
            Value::Nil => Ok(Numbers { shape: vec![], values: vec![f32::NAN] }),
            Value::List(list) => {
                let mut inner: Option<Vec<usize>> = None;
                let mut values = Vec::with_capacity(list.len());
                for value in list {
                    let part = value.numbers()?;
                    if inner.get_or_insert_with(|| part.shape.clone()) != &part.shape {
                        return Err("lists of different lengths".into());
                    }
                    values.extend(part.values);
                }
                let shape = [vec![list.len()], inner.unwrap_or_default()].concat();
                Ok(Numbers { shape, values })
            }
            other => Err(format!("{} instead of numbers", other.kind())),
        }
    }

    /// From JSON.
    pub fn of_json(json: &'a Json) -> Self {
        match json {
            Json::Null => Value::Nil,
            Json::Bool(flag) => Value::Bool(*flag),
            Json::Number(number) => match number.as_i64() {
                Some(whole) => Value::Int(whole),
                None => Value::Float(number.as_f64().unwrap_or(f64::NAN)),
            },
            Json::String(text) => Value::text(text.as_str()),
            Json::Array(list) => Value::List(list.iter().map(Value::of_json).collect()),
            Json::Object(map) => {
                Value::Map(map.iter().map(|(name, value)| (Cow::Borrowed(name.as_str()), Value::of_json(value))).collect())
            }
        }
    }

    /// As JSON: arrays become lists, what is no finite number becomes null, bytes their number.
    pub fn to_json(&self) -> Json {
        match self {
            Value::Nil => Json::Null,
            Value::Bool(flag) => (*flag).into(),
            Value::Int(number) => (*number).into(),
            Value::Float(number) => (*number).into(),
            Value::Text(text) => text.as_ref().into(),
            Value::Bytes(bytes) => bytes.len().into(),
            Value::List(list) => list.iter().map(Value::to_json).collect(),
            Value::Map(entries) => {
                Json::Object(entries.iter().map(|(name, value)| (name.to_string(), value.to_json())).collect::<Map<_, _>>())
            }
            Value::Array(array) => nested(array.shape(), &array.to_f32()),
        }
    }
}

impl Numbers {
    /// The numbers as rows of `width`: one row, or as many as the second last dimension has; dimensions of length 1 before them count for nothing.
    pub fn rows(self, width: usize) -> Option<Vec<Vec<f32>>> {
        let (last, rest) = self.shape.split_last()?;
        let (count, before) = rest.split_last().map_or((1, &[][..]), |(count, before)| (*count, before));
        let fits = *last == width && width > 0 && count > 0 && before.iter().all(|length| *length == 1);
        fits.then(|| self.values.chunks_exact(width).map(<[f32]>::to_vec).collect())
    }
}

fn nested(shape: &[usize], values: &[f32]) -> Json {
    match shape.split_first() {
        None => values.first().map_or(Json::Null, |v| f64::from(*v).into()),
        Some((0, _)) => Json::Array(Vec::new()),
        Some((length, inner)) if values.is_empty() => Json::Array(vec![nested(inner, &[]); (*length).min(1)]),
        Some((length, inner)) => values.chunks(values.len() / length).map(|part| nested(inner, part)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn numbers_come_from_lists_and_arrays_alike() {
        let json = json!([[0.5, 1], [2, 3.25]]);
        let listed = Value::of_json(&json).numbers().expect("numbers");
        let array = Array::f32(&[2, 2], &[0.5, 1.0, 2.0, 3.25]);
        assert_eq!(Value::Array(array.clone()).numbers().as_ref(), Ok(&listed));
        assert_eq!(Value::Array(array).to_json(), json!([[0.5, 1.0], [2.0, 3.25]]));
        assert_eq!(listed.rows(2), Some(vec![vec![0.5, 1.0], vec![2.0, 3.25]]));
        for odd in [json!([[1], [1, 2]]), json!([1, [2]]), json!([1, "2"]), json!({ "a": 1 }), json!("1")] {
            assert!(Value::of_json(&odd).numbers().is_err(), "{odd}");
        }
    }

    #[test]
    fn rows_are_those_of_their_width() {
        let rows = |shape: &[usize], width| {
            let values = vec![0.0; shape.iter().product()];
            Numbers { shape: shape.to_vec(), values }.rows(width).map(|rows| rows.len())
        };
        assert_eq!(
            [rows(&[3], 3), rows(&[1, 3], 3), rows(&[5, 3], 3), rows(&[1, 5, 3], 3)],
            [Some(1), Some(1), Some(5), Some(5)]
        );
        assert_eq!([rows(&[3], 4), rows(&[2, 5, 3], 3), rows(&[], 1), rows(&[0, 3], 3), rows(&[0], 0)], [None; 5]);
    }
}
