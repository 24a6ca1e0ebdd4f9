//! Whole files with another value in some place of what they describe themselves with.

use super::mutate::{self, below, one_in, pick};
use super::sources;
use hilt::table::{Table, Values};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

/// Bytes of the length before the header of weights.
const LENGTH: usize = 8;

/// Plans with other numbers, scenes or columns.
pub fn other_table(table: &Table, rng: &mut ChaCha8Rng) -> Option<Vec<u8>> {
    let mut table = table.clone();
    for _ in 0..rng.random_range(1..4) {
        let at = mutate::below(table.columns.len(), rng);
        let row = mutate::below(table.rows().max(1), rng);
        match &mut table.columns[at].values {
            Values::F32(v) => v[row] = mutate::number(rng) as f32,
            Values::F64(v) => v[row] = mutate::number(rng),
            Values::I64(v) => v[row] = *pick(&[-1, 0, 1, i64::MAX, i64::MIN, 1 << 40], rng),
            Values::Bool(v) => v[row] ^= true,
            Values::Text(v) => {
                // A scene stands on an episode's first row only.
                let text = v.iter_mut().find(|text| text.starts_with('{'));
                if let Some(Ok(mut scene)) = text.as_ref().map(|text| serde_json::from_str::<Value>(text)) {
                    mutate::value(&mut scene, rng);
                    text.into_iter().for_each(|text| *text = scene.to_string());
                } else {
                    v[row] = mutate::text(&v[row].clone(), rng);
                }
            }
        }
    }
    if one_in(8, rng) {
        table.columns.remove(mutate::below(table.columns.len(), rng));
    }
    sources::table(&table)
}

/// Lines of JSON with another value in one of them.
pub fn other_line(text: &[u8], rng: &mut ChaCha8Rng) -> Option<Vec<u8>> {
    let mut lines: Vec<String> = std::str::from_utf8(text).ok()?.lines().map(String::from).collect();
    let hit = mutate::below(lines.len(), rng);
    let mut value: Value = serde_json::from_str(&lines[hit]).ok()?;
    mutate::value(&mut value, rng);
    lines[hit] = value.to_string();
    Some((lines.join("\n") + "\n").into_bytes())
}

/// JSON with another value in some place.
pub fn other_json(whole: &[u8], rng: &mut ChaCha8Rng) -> Option<Vec<u8>> {
    let mut content: Value = serde_json::from_slice(whole).ok()?;
    mutate::value(&mut content, rng);
    serde_json::to_vec_pretty(&content).ok()
}

/// TOML with another value in some place.
pub fn other_toml(whole: &[u8], rng: &mut ChaCha8Rng) -> Option<Vec<u8>> {
    let table: toml::Table = std::str::from_utf8(whole).ok()?.parse().ok()?;
    let mut content = serde_json::to_value(table).ok()?;
    mutate::value(&mut content, rng);
    toml::to_string(&content).ok().map(String::into_bytes)
}

/// XML with another value in one of its attributes: one from elsewhere in it, hostile numbers in place of a number, or fewer or more of them.
pub fn other_xml(whole: &[u8], rng: &mut ChaCha8Rng) -> Option<Vec<u8>> {
    let mut parts: Vec<String> = std::str::from_utf8(whole).ok()?.split('"').map(String::from).collect();
    // What stands between quotes is every second part.
    let hit = 2 * below(parts.len() / 2, rng) + 1;
    let other = parts[2 * below(parts.len() / 2, rng) + 1].clone();
    let mut words: Vec<String> = parts[hit].split(' ').map(String::from).collect();
    let at = below(words.len(), rng);
    match below(4, rng) {
        0 => words = vec![other],
        1 => words.push(other),
        2 => words.truncate(at),
        _ => words[at] = mutate::number(rng).to_string(),
    }
    parts[hit] = words.join(" ");
    Some(parts.join("\"").into_bytes())
}

/// Weights whose last number is another.
pub fn with_bytes(whole: &[u8], number: f32) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    let at = bytes.len() - size_of::<f32>();
    bytes[at..].copy_from_slice(&number.to_le_bytes());
    bytes
}

/// Weights with another value in their header, or in the header of hilt within it.
pub fn other_header(whole: &[u8], rng: &mut ChaCha8Rng) -> Option<Vec<u8>> {
    let end = LENGTH + u64::from_le_bytes(whole[..LENGTH].try_into().ok()?) as usize;
    let mut header: Value = serde_json::from_slice(&whole[LENGTH..end]).ok()?;
    if one_in(2, rng) {
        let inner = &mut header["__metadata__"]["hilt"];
        let mut hilt: Value = serde_json::from_str(inner.as_str()?).ok()?;
        mutate::value(&mut hilt, rng);
        *inner = hilt.to_string().into();
    } else {
        mutate::value(&mut header, rng);
    }
    let header = header.to_string();
    Some([&(header.len() as u64).to_le_bytes(), header.as_bytes(), &whole[end..]].concat())
}
