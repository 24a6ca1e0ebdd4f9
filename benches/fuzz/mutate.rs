//! Changes that break bytes, and JSON values that nobody of good will writes.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

/// Numbers at the ends of what counts and lengths can be.
const INTERESTING: [u64; 10] =
    [0, 1, i32::MAX as u64, u32::MAX as u64, 1 << 31, 1 << 32, 1 << 62, 1 << 63, i64::MAX as u64, u64::MAX];
/// Most changes of one input.
const MOST_CHANGES: u32 = 4;
/// Bytes of an insertion or a deletion.
const PIECE: usize = 64;

/// A position below `len`, which is not 0.
pub fn below(len: usize, rng: &mut ChaCha8Rng) -> usize {
    rng.random_range(0..len)
}

/// One of several.
pub fn pick<'a, T>(of: &'a [T], rng: &mut ChaCha8Rng) -> &'a T {
    &of[below(of.len(), rng)]
}

/// Whether a chance of one in `of` came true.
pub fn one_in(of: u32, rng: &mut ChaCha8Rng) -> bool {
    rng.random_range(0..of) == 0
}

/// Some changes of `bytes`; `other` is what pieces are taken from.
pub fn bytes(mut bytes: Vec<u8>, other: &[u8], rng: &mut ChaCha8Rng) -> Vec<u8> {
    for _ in 0..rng.random_range(1..=MOST_CHANGES) {
        if bytes.is_empty() {
            return bytes;
        }
        change(&mut bytes, other, rng);
    }
    bytes
}

fn change(bytes: &mut Vec<u8>, other: &[u8], rng: &mut ChaCha8Rng) {
    // Half of all changes hit a beginning or an end, where lengths and offsets are.
    let at = match rng.random_range(0..4) {
        0 => below(bytes.len().min(PIECE), rng),
        1 => bytes.len() - 1 - below(bytes.len().min(4 * PIECE), rng),
        _ => below(bytes.len(), rng),
    };
    let end = (at + 1 + below(PIECE, rng)).min(bytes.len());
    match rng.random_range(0..10) {
        0 | 1 => bytes[at] ^= 1 << rng.random_range(0..8),
        2 | 3 => bytes[at] = rng.random(),
        4 => bytes.truncate(at),
        5 => drop(bytes.drain(at..end)),
        6 => drop(bytes.splice(at..at, (0..end - at).map(|i| i as u8).collect::<Vec<_>>())),
        7 if !other.is_empty() => {
            let from = below(other.len(), rng);
            let to = (from + PIECE * PIECE).min(other.len());
            let until = (at + (to - from)).min(bytes.len());
            drop(bytes.splice(at..until, other[from..to].to_vec()));
        }
        kind => {
            let number = pick(&INTERESTING, rng).to_le_bytes();
            let width = if kind == 8 { 4 } else { 8 };
            let at = at.min(bytes.len().saturating_sub(width));
            bytes.iter_mut().skip(at).zip(&number[..width]).for_each(|(byte, new)| *byte = *new);
        }
    }
}

/// Some changes of a text that stays one.
pub fn text(text: &str, rng: &mut ChaCha8Rng) -> String {
    String::from_utf8_lossy(&bytes(text.as_bytes().to_vec(), text.as_bytes(), rng)).into_owned()
}

/// Puts a hostile value in some place of a value.
pub fn value(root: &mut Value, rng: &mut ChaCha8Rng) {
    let mut here = root;
    while !one_in(4, rng) {
        let count = match &*here {
            Value::Object(fields) => fields.len(),
            Value::Array(items) => items.len(),
            _ => 0,
        };
        if count == 0 {
            break;
        }
        let at = below(count, rng);
        here = match here {
            Value::Object(fields) => fields.iter_mut().nth(at).expect("counted").1,
            Value::Array(items) => &mut items[at],
            _ => unreachable!("what has entries is a list or an object"),
        };
    }
    match here {
        Value::Object(fields) if one_in(3, rng) => {
            let name = fields.keys().next().cloned().unwrap_or_default();
            fields.remove(&name);
        }
        Value::Array(items) if one_in(3, rng) => items.extend(items.clone().into_iter().take(1)),
        Value::String(words) if one_in(2, rng) => *words = text(words, rng),
        here => *here = hostile(rng),
    }
}

fn hostile(rng: &mut ChaCha8Rng) -> Value {
    match rng.random_range(0..14) {
        0 => Value::Null,
        1 => json!(true),
        2 => json!(-1),
        3 => json!(pick(&[1e308, -1e308, 1e-308, -0.0, 0.5, 1e15], rng)),
        4 => json!({}),
        5 => json!([]),
        6 => json!([0]),
        7 => json!(""),
        8 => json!("../../../etc/passwd"),
        9 => json!("x".repeat(below(20_000, rng))),
        10 => json!(vec![0u8; below(5000, rng)]),
        11 => (0..below(200, rng)).fold(json!(1), |inner, _| json!([inner])),
        _ => json!(pick(&INTERESTING, rng)),
    }
}

/// A number that breaks sums, comparisons or casts.
pub fn number(rng: &mut ChaCha8Rng) -> f64 {
    *pick(&[f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e308, -1e308, 1e300, 5e-324, -0.0, 0.0, -1.0, 1e9], rng)
}
