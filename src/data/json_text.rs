//! JSON that others may have written: weighed before it is parsed, because two bytes of text can become hundreds in memory.

use serde::de::DeserializeOwned;

/// What a parsed text may take: a checkpoint after 60,000 epochs takes half of it.
const MOST_BYTES: usize = 512 << 20;
/// An object with one entry: a node of its map.
const OBJECT_BYTES: usize = 700;
/// A list with one entry: what a list allots at first.
const LIST_BYTES: usize = 160;
/// A value in a list or an object, and its place.
const VALUE_BYTES: usize = 64;

/// Parses a text.
///
/// # Errors
/// Says that it is too heavy, or what is wrong with it.
pub(super) fn parse<T: DeserializeOwned>(text: &[u8]) -> Result<T, String> {
    let weight = weight(text);
    if weight > MOST_BYTES {
        return Err(format!("it would take some {weight} bytes of memory, {MOST_BYTES} are the most"));
    }
    serde_json::from_slice(text).map_err(|e| e.to_string())
}

/// About the most memory that the values of a text take, its strings apart.
fn weight(text: &[u8]) -> usize {
    let (mut weight, mut in_string, mut escaped) = (0, false, false);
    for byte in text {
        match byte {
            _ if escaped => escaped = false,
            b'\\' => escaped = in_string,
            b'"' => in_string = !in_string,
            _ if in_string => {}
            b'{' => weight += OBJECT_BYTES,
            b'[' => weight += LIST_BYTES,
            b',' => weight += VALUE_BYTES,
            _ => {}
        }
    }
    weight
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    #[test]
    fn a_text_that_would_take_all_memory_is_refused_before_it_is_parsed() {
        assert_eq!(weight(br#"{"a{[,\"[": [1, 2], "b": {}}"#), 2 * OBJECT_BYTES + LIST_BYTES + 2 * VALUE_BYTES);
        let heavy = format!("[{}0]", "[],".repeat(3_000_000));
        let said = parse::<Value>(heavy.as_bytes()).expect_err("too heavy");
        assert!(said.contains("bytes of memory"), "{said}");
        assert!(parse::<Value>(br#"{"a": [1, 2, "{"]}"#).is_ok());
    }
}
