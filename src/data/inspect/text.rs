//! An answer of `inspect` in words: plain fields as lines, then nested objects, indented, and lists of objects as tables.

use crate::math::log10;
use serde_json::{Map, Value};

/// Significant digits of a number.
const DIGITS: i32 = 5;
/// Fields that come first, in this order; the rest follows by name.
const FIRST: [&str; 14] = [
    "kind",
    "name",
    "task",
    "instruction",
    "stage",
    "network",
    "episode",
    "episodes",
    "rows",
    "type",
    "unit",
    "shape",
    "parameters",
    "provenance",
];
/// Statistics in their usual order, then words.
const LAST: [&str; 6] = ["min", "max", "mean", "std", "not_finite", "doc"];

/// The value as lines of text, ending with a newline.
pub fn inspect_text(value: &Value) -> String {
    let mut out = String::new();
    match value {
        Value::Object(fields) => write_fields(fields, 0, &mut out),
        other => out = scalar(other) + "\n",
    }
    out
}

fn write_fields(fields: &Map<String, Value>, depth: usize, out: &mut String) {
    let indent = "  ".repeat(depth);
    let (sections, lines): (Vec<&str>, Vec<&str>) = ordered(fields.keys()).into_iter().partition(|k| is_section(&fields[*k]));
    for key in lines.into_iter().chain(sections) {
        match &fields[key] {
            Value::Object(inner) if is_section(&fields[key]) => {
                *out += &format!("{indent}{key}\n");
                write_fields(inner, depth + 1, out);
            }
            Value::Array(rows) if is_section(&fields[key]) => {
                *out += &format!("{indent}{key}\n");
                write_table(rows, depth + 1, out);
            }
            other => *out += &format!("{indent}{key}: {}\n", scalar(other)),
        }
    }
}

/// Whether a value takes lines of its own.
fn is_section(value: &Value) -> bool {
    match value {
        Value::Object(inner) => !inner.is_empty(),
        Value::Array(rows) => rows.iter().any(Value::is_object),
        _ => false,
    }
}

/// Rows of objects as aligned columns.
fn write_table(rows: &[Value], depth: usize, out: &mut String) {
    let objects: Vec<&Map<String, Value>> = rows.iter().filter_map(Value::as_object).collect();
    let keys = ordered(objects.iter().flat_map(|o| o.keys()));
    let cell = |o: &Map<String, Value>, key: &str| o.get(key).map(scalar).unwrap_or_default();
    let mut lines: Vec<Vec<String>> = vec![keys.iter().map(|k| k.to_string()).collect()];
    lines.extend(objects.iter().map(|o| keys.iter().map(|k| cell(o, k)).collect()));
    let widths: Vec<usize> =
        (0..keys.len()).map(|i| lines.iter().map(|line| line[i].chars().count()).max().unwrap_or_default()).collect();
    for line in lines {
        let cells: Vec<String> = line.iter().zip(&widths).map(|(text, width)| format!("{text:<width$}")).collect();
        *out += &format!("{}{}\n", "  ".repeat(depth), cells.join("  ").trim_end());
    }
}

/// Keys without repetition: the usual first ones, the rest by name, statistics and words last.
fn ordered<'a>(keys: impl Iterator<Item = &'a String>) -> Vec<&'a str> {
    let place = |list: &[&str], key: &str| list.iter().position(|k| *k == key);
    let rank = |key: &str| match (place(&FIRST, key), place(&LAST, key)) {
        (Some(i), _) => (0, i),
        (_, Some(i)) => (2, i),
        _ => (1, 0),
    };
    let mut found: Vec<&str> = keys.map(String::as_str).collect();
    found.sort_by_key(|key| (rank(key), *key));
    found.dedup();
    found
}

fn scalar(value: &Value) -> String {
    match value {
        Value::Null => "-".into(),
        Value::String(text) => text.clone(),
        Value::Number(n) if n.is_f64() => n.as_f64().map_or_else(String::new, number),
        Value::Array(items) => items.iter().map(scalar).collect::<Vec<_>>().join(" "),
        Value::Object(fields) if fields.is_empty() => "none".into(),
        other => other.to_string(),
    }
}

/// A number with [`DIGITS`] significant digits, plain where that is short.
fn number(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let magnitude = log10(value.abs()).floor() as i32;
    if !(-4..=DIGITS).contains(&magnitude) {
        return format!("{value:.*e}", DIGITS as usize - 1);
    }
    let text = format!("{value:.*}", (DIGITS - 1 - magnitude).max(0) as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_string() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn numbers_fields_and_tables_read_well() {
        let numbers =
            [(0.0, "0"), (0.5, "0.5"), (123.456789, "123.46"), (-1.23456e-7, "-1.2346e-7"), (1e9, "1.0000e9"), (20.0, "20")];
        for (value, text) in numbers {
            assert_eq!(number(value), text);
        }
        let value =
            json!({ "rows": 2, "kind": "table", "columns": [{ "name": "a", "max": 2.5 }, { "name": "bcd", "doc": "x" }] });
        let expected = "kind: table\nrows: 2\ncolumns\n  name  max  doc\n  a     2.5\n  bcd        x\n";
        assert_eq!(inspect_text(&value), expected);
    }
}
