//! Metrics of a training as it goes: a line of JSON an epoch, appended when the epoch has ended. `null` is what was not computed. No times: the same training
//! writes the same bytes. The table that training ends with is the artefact; this is for who watches.

use super::bytes::Format;
use crate::error::{Error, Result};
use crate::interrupt;
use crate::table::{Table, Values};
use serde_json::{Map, Value, json};
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// The ending of such a file's name.
pub const ENDING: &str = "jsonl";
/// Keys that are no metrics.
const STAGE: &str = "stage";
const EPOCH: &str = "epoch";
const EPOCHS: &str = "epochs";
const UPDATES: &str = "updates";

const FORMAT: Format = Format {
    most_bytes: 1 << 30,
    reason: "a line of metrics has less than 1 kB, and there are at most some hundred thousand",
    head: |_, _| Ok(()),
    ends: |_, _| Ok(()),
};
/// A line that is longer is none of ours.
const LONGEST_LINE: u64 = 1 << 16;

/// The line of an epoch, with its line feed.
pub fn line<'a>(stage: &str, place: [u64; 2], updates: u64, values: impl Iterator<Item = (&'a str, f64)>) -> String {
    let [epoch, epochs] = place;
    let mut fields = Map::from_iter(
        [(STAGE, json!(stage)), (EPOCH, json!(epoch)), (EPOCHS, json!(epochs)), (UPDATES, json!(updates))]
            .map(|(k, v)| (k.to_string(), v)),
    );
    // What is no number has no form in JSON: serde_json makes it null.
    fields.extend(values.map(|(name, value)| (name.to_string(), json!(value))));
    format!("{}\n", Value::Object(fields))
}

/// Whether the first line of a file is one of these; an empty file is as good.
pub fn is_ours(path: &Path) -> bool {
    let _waits = interrupt::waiting();
    let Ok(file) = File::open(path) else { return false };
    let mut first = Vec::new();
    let read = BufReader::new(file.take(LONGEST_LINE)).read_until(b'\n', &mut first);
    read.is_ok() && (first.is_empty() || parsed(&first).is_some())
}

fn parsed(line: &[u8]) -> Option<Map<String, Value>> {
    let fields: Map<String, Value> = serde_json::from_slice(line).ok()?;
    let whole = fields.get(STAGE)?.is_string() && fields.get(EPOCH)?.is_u64() && fields.get(UPDATES)?.is_u64();
    whole.then_some(fields)
}

/// The epochs so far, in the columns of the table that training ends with; a last line that is not whole yet is left out.
///
/// # Errors
/// [`Error::Input`] when a whole line is none of these; [`Error::Io`] when the file cannot be read.
pub fn read(path: &Path) -> Result<Table> {
    let bytes = FORMAT.read(path)?;
    let whole = bytes.iter().rposition(|byte| *byte == b'\n').map_or(&[][..], |end| &bytes[..end]);
    let mut rows = Vec::new();
    for (at, line) in whole.split(|byte| *byte == b'\n').enumerate().filter(|(_, line)| !line.is_empty()) {
        let fields = parsed(line).ok_or_else(|| {
            let number = at + 1;
            Error::input(
                path,
                format!("line {number} is no epoch of a training; expected what --live of hilt train or pretrain writes"),
            )
        })?;
        rows.push(fields);
    }
    let known = [STAGE, EPOCH, EPOCHS, UPDATES];
    let names: BTreeSet<&String> = rows.iter().flat_map(|row| row.keys()).filter(|key| !known.contains(&key.as_str())).collect();
    let whole_numbers = |key: &str| Values::I64(rows.iter().map(|row| row[key].as_u64().unwrap_or(0).cast_signed()).collect());
    let stages = Values::Text(rows.iter().map(|row| row[STAGE].as_str().unwrap_or_default().to_string()).collect());
    let mut table = Table::default()
        .with(STAGE, "Stage of training", stages)
        .with(EPOCH, "Epoch of the stage, from 1", whole_numbers(EPOCH))
        .with(UPDATES, "Updates of the stage so far", whole_numbers(UPDATES));
    for name in names {
        let values = rows.iter().map(|row| row.get(name).and_then(Value::as_f64).unwrap_or(f64::NAN)).collect();
        table = table.with(name, "", Values::F64(values));
    }
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_come_back_as_the_columns_of_a_training_and_an_unfinished_one_waits() {
        let dir = tempfile::tempdir().expect("temporary directory");
        let path = dir.path().join("policy.training.jsonl");
        let values = |l_sc: f64| [("l_bc", 0.1), ("l_sc", l_sc)].into_iter();
        let text = line("warm-start", [1, 2], 5, values(f64::NAN)) + &line("hil", [1, 3], 2, values(0.25));
        std::fs::write(&path, format!("{text}{{\"stage\": \"hil\", \"epo")).expect("written");
        let table = read(&path).expect("a table");
        assert_eq!(table.rows(), 2);
        assert_eq!(table.column("updates").expect("a column").values, Values::I64(vec![5, 2]));
        let Values::F64(l_sc) = &table.column("l_sc").expect("a column").values else { panic!("numbers") };
        assert!(l_sc[0].is_nan() && l_sc[1] == 0.25);
        assert!(is_ours(&path));
        std::fs::write(&path, "{\"a\": 1}\n").expect("written");
        assert!(!is_ours(&path) && read(&path).expect_err("refused").to_string().contains("line 1 is no epoch"));
    }
}
