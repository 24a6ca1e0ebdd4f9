//! Files keep what they are given, are the same bytes every time, and say so when they are damaged.

mod datasets;
mod fixtures;
mod hostile;
mod interop;
mod limits;
mod viewers;

use fixtures::{contents, episode, provenance, table, tensors};
use hilt::data::{ContentHash, inspect, inspect_text, json_file, recording, table_file, weights};
use hilt::error::{Error, Result};
use hilt::interrupt::Interrupt;
use hilt::robot::file::built_in::paper_robot;
use hilt::table::{Table, Values};
use hilt::task::built_in::{of_the_paper, pick_and_place, pick_up, stack};
use serde_json::json;
use std::fs;
use std::path::Path;
use tempfile::tempdir;

/// Places at which a file is cut and changed, beside its last bytes.
const PLACES: usize = 80;

/// Cuts a file at many lengths and flips a bit at many places: `read` must refuse each, naming the file.
pub fn refuses_damage<T>(path: &Path, read: impl Fn() -> Result<T>) {
    let whole = fs::read(path).expect("a file");
    let check = |what: String, bytes: &[u8]| {
        fs::write(path, bytes).expect("damaged");
        match read() {
            Ok(_) => panic!("{}: {what} was not noticed", path.display()),
            Err(Error::Input { path: named, message }) => {
                assert!(path.starts_with(&named) && !message.is_empty(), "{what}: {message}")
            }
            Err(other) => panic!("{what}: {other}"),
        }
    };
    let stride = (whole.len() / PLACES).max(1);
    for at in (0..whole.len()).step_by(stride).chain(whole.len().saturating_sub(40)..whole.len()) {
        check(format!("cut at {at} of {}", whole.len()), &whole[..at]);
        let mut bytes = whole.clone();
        bytes[at] ^= 1 << (at % 8);
        check(format!("bit flipped at {at} of {}", whole.len()), &bytes);
    }
    check("a byte too many".into(), &[&whole[..], b"x"].concat());
    check("zeros".into(), &vec![0; whole.len()]);
    check("other text".into(), b"{\"kind\": \"something else\"}");
    fs::write(path, whole).expect("restored");
    assert!(read().is_ok());
}

#[test]
fn recordings_round_trip_exactly_and_are_the_same_bytes_anywhere() {
    let (here, there) = (tempdir().expect("dir"), tempdir().expect("dir"));
    for (task, index) in of_the_paper().into_iter().zip(4..) {
        let (made, origin) = (episode(&task, index, 30), provenance("simulate", &task));
        let name = recording::file_name(index);
        recording::write(&here.path().join(&name), &made, &origin).expect("written");
        recording::write(&there.path().join(&name), &made, &origin).expect("written");
        let (found, found_origin) = recording::read(&here.path().join(&name)).expect("readable");
        assert_eq!(found, made);
        assert_eq!(found.to_demo(), made.to_demo());
        assert_eq!(found.steps[0].commanded[3].to_bits(), (-0.0f64).to_bits());
        assert_eq!(found_origin, origin);
    }
    assert_eq!(contents(here.path()), contents(there.path()));
}

#[test]
fn damaged_recordings_are_refused() {
    let dir = tempdir().expect("dir");
    let path = dir.path().join("episode-00001.mcap");
    recording::write(&path, &episode(&stack(), 1, 12), &provenance("simulate", &stack())).expect("written");
    refuses_damage(&path, || recording::read(&path));
}

#[test]
fn a_foreign_mcap_file_is_refused() {
    let dir = tempdir().expect("dir");
    let path = dir.path().join("other.mcap");
    let mut writer = mcap::Writer::new(fs::File::create(&path).expect("file")).expect("writer");
    writer.finish().expect("finished");
    let message = recording::read(&path).unwrap_err().to_string();
    assert!(message.contains("another program"), "{message}");
}

#[test]
fn tables_round_trip_with_nan_and_damage_is_refused() {
    let dir = tempdir().expect("dir");
    let origin = provenance("plan", &pick_up());
    for rows in [0, 1, 3000] {
        let (made, path) = (table(rows), dir.path().join(format!("{rows}.parquet")));
        table_file::write(&path, &made, &origin).expect("written");
        let bytes = fs::read(&path).expect("bytes");
        table_file::write(&path, &made, &origin).expect("written again");
        assert_eq!(fs::read(&path).expect("bytes"), bytes);
        let (found, found_origin) = table_file::read(&path).expect("readable");
        assert_eq!(found_origin, origin);
        for (a, b) in found.columns.iter().zip(&made.columns) {
            assert_eq!((&a.name, &a.doc), (&b.name, &b.doc));
            match (&a.values, &b.values) {
                (Values::F64(a), Values::F64(b)) => assert!(a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())),
                (a, b) => assert_eq!(a, b),
            }
        }
    }
    let path = dir.path().join("3000.parquet");
    refuses_damage(&path, || table_file::read(&path));
}

/// The rows of several tables, column by column, in words: NaN is like NaN.
fn rows(tables: &[Table]) -> Vec<Vec<String>> {
    fn words<T: std::fmt::Debug>(values: &[T]) -> Vec<String> {
        values.iter().map(|value| format!("{value:?}")).collect()
    }
    let cells = |values: &Values| match values {
        Values::F32(v) => words(v),
        Values::F64(v) => words(v),
        Values::I64(v) => words(v),
        Values::Bool(v) => words(v),
        Values::Text(v) => words(v),
    };
    (0..tables[0].columns.len()).map(|i| tables.iter().flat_map(|t| cells(&t.columns[i].values)).collect()).collect()
}

#[test]
fn a_table_that_is_written_and_read_in_pieces_is_the_same_table_and_damage_is_refused() {
    let dir = tempdir().expect("dir");
    let (path, origin) = (dir.path().join("groups.parquet"), provenance("plan", &pick_up()));
    let groups = [9000, 1, 20].map(table);
    table_file::write_groups(&path, groups.iter().cloned().map(Ok), &origin).expect("written");
    let bytes = fs::read(&path).expect("bytes");
    let (whole, _) = table_file::read(&path).expect("readable as a whole");
    let reader = table_file::Reader::open(&path).expect("readable");
    assert_eq!((reader.provenance(), reader.content()), (&origin, ContentHash::of(&bytes)));
    for _pass in 0..2 {
        let pieces = reader.tables().expect("rows").collect::<Result<Vec<_>>>().expect("readable");
        assert!(pieces.len() > 1 && pieces.iter().map(Table::rows).sum::<usize>() == whole.rows());
        assert_eq!(rows(&pieces), rows(&groups));
    }
    assert_eq!(rows(&[whole]), rows(&groups));
    refuses_damage(&path, || table_file::Reader::open(&path).map(drop));

    // One group is the file of one table; an error or no group leaves what is there.
    table_file::write_groups(&path, [Ok(table(30))].into_iter(), &origin).expect("written");
    assert_eq!(fs::read(&path).expect("bytes"), table_file::encode(&path, &table(30), &origin).expect("encoded"));
    let failing = [Ok(table(3)), Err(Error::Failed("no more".into()))];
    assert!(table_file::write_groups(&path, failing.into_iter(), &origin).is_err());
    table_file::write_groups(&path, std::iter::empty(), &origin).expect("nothing to do");
    assert_eq!(table_file::read(&path).expect("the one before").0.rows(), 30);
    assert_eq!(fs::read_dir(dir.path()).expect("readable").count(), 1, "left over");
}

#[test]
fn weights_round_trip_in_order_and_damage_is_refused() {
    let dir = tempdir().expect("dir");
    let path = dir.path().join("policy.safetensors");
    let (made, meta, origin) = (tensors(), json!({ "mean": [0.5, 1e-7], "hidden": 32 }), provenance("train", &pick_up()));
    weights::write(&path, "policy", &made, &meta, &origin).expect("written");
    let bytes = fs::read(&path).expect("bytes");
    weights::write(&path, "policy", &made, &meta, &origin).expect("written again");
    assert_eq!(fs::read(&path).expect("bytes"), bytes);
    assert_eq!(weights::read(&path, "policy").expect("readable"), (made, meta, origin));
    let message = weights::read(&path, "dynamics").unwrap_err().to_string();
    assert!(message.contains("policy network, a dynamics network is needed"), "{message}");
    refuses_damage(&path, || weights::read(&path, "policy"));
}

#[test]
fn weights_that_are_not_finite_are_refused_and_the_old_file_stays() {
    let dir = tempdir().expect("dir");
    let path = dir.path().join("policy.safetensors");
    let (mut made, origin) = (tensors(), provenance("train", &pick_up()));
    weights::write(&path, "policy", &made, &json!({}), &origin).expect("written");
    let before = contents(&path);
    made[1].data[5] = f32::NAN;
    let message = weights::write(&path, "policy", &made, &json!({}), &origin).unwrap_err().to_string();
    assert!(message.contains("policy.layer_1.weight: number 5 is NaN"), "{message}");
    assert_eq!(contents(&path), before);
    // A NaN put in by another program is named as such.
    let mut bytes = fs::read(&path).expect("bytes");
    let end = bytes.len();
    bytes[end - 4..].copy_from_slice(&f32::NAN.to_le_bytes());
    fs::write(&path, bytes).expect("edited");
    let message = weights::read(&path, "policy").unwrap_err().to_string();
    assert!(message.contains("is NaN, weights must be finite"), "{message}");
}

#[test]
fn summaries_round_trip_and_damage_is_refused() {
    let dir = tempdir().expect("dir");
    let path = dir.path().join("evaluation.json");
    let (content, origin) =
        (json!({ "task": "stack", "wilson_95": [0.9, 0.95], "episodes": 500 }), provenance("evaluate", &stack()));
    json_file::write(&path, &content, &origin).expect("written");
    assert_eq!(json_file::read(&path).expect("readable"), (content, origin));
    refuses_damage(&path, || json_file::read(&path));
}

#[test]
fn another_schema_version_is_named_whoever_wrote_it() {
    let dir = tempdir().expect("dir");
    let task = pick_up();
    let mut newer = provenance("simulate", &task);
    newer.schema_version = 2;
    let at = |name: &str| dir.path().join(name);
    let write_all = |origin: &hilt::data::Provenance| {
        recording::write(&at("a.mcap"), &episode(&task, 0, 3), origin).expect("written");
        table_file::write(&at("a.parquet"), &table(3), origin).expect("written");
        weights::write(&at("a.safetensors"), "policy", &tensors(), &json!({}), origin).expect("written");
        json_file::write(&at("a.json"), &json!({}), origin).expect("written");
    };
    let names = ["a.mcap", "a.parquet", "a.safetensors", "a.json"];
    write_all(&newer);
    for name in names {
        let message = inspect(&at(name), &Interrupt::default()).unwrap_err().to_string();
        assert!(message.contains("schema version 2, this hilt reads version 1"), "{message}");
    }
    write_all(&provenance("simulate", &task));
    for name in names {
        // The same, by an editor of bytes.
        let mut bytes = fs::read(at(name)).expect("bytes");
        let places: Vec<usize> = (0..bytes.len()).filter(|i| bytes[*i..].starts_with(b"schema_version")).collect();
        for place in places {
            let digit = place + bytes[place..].iter().position(|b| *b == b'1').expect("a version");
            bytes[digit] = b'5';
        }
        fs::write(at(name), bytes).expect("edited");
        let message = inspect(&at(name), &Interrupt::default()).unwrap_err().to_string();
        assert!(message.contains("schema version 5"), "{message}");
    }
}

#[test]
fn a_missing_file_is_an_error_of_the_system() {
    let path = Path::new("no/such/episode-00000.mcap");
    assert!(matches!(recording::read(path), Err(Error::Io { action: "read", .. })));
    assert!(matches!(inspect(path, &Interrupt::default()), Err(Error::Io { .. })));
}

#[test]
fn inspect_knows_every_kind() {
    let dir = tempdir().expect("dir");
    let task = pick_and_place();
    let origin = provenance("simulate", &task);
    let at = |name: &str| dir.path().join(name);
    for index in 0..3 {
        let path = at("recordings").join(recording::file_name(index));
        recording::write(&path, &episode(&task, index, 9), &origin).expect("written");
    }
    table_file::write(&at("t.parquet"), &table(50), &origin).expect("written");
    weights::write(&at("w.safetensors"), "dynamics", &tensors(), &json!({ "hidden": 32 }), &origin).expect("written");
    json_file::write(&at("e.json"), &json!({ "success_rate": 0.98 }), &origin).expect("written");
    let kind = |name: &str| {
        let found = inspect(&at(name), &Interrupt::default()).expect("an artefact");
        assert_eq!(found["provenance"]["seed"], 7);
        assert!(inspect_text(&found).contains("stage: simulate"));
        found
    };
    let all = kind("recordings");
    assert_eq!((&all["kind"], &all["episodes"], &all["successes"]), (&json!("recordings"), &json!(3), &json!(2)));
    assert_eq!(all["failures"], json!({ "dropped": 1 }));
    let one = kind("recordings/episode-00001.mcap");
    assert_eq!((&one["steps"], &one["duration_s"]), (&json!(9), &json!(0.45)));
    assert_eq!(one["states"].as_array().map(Vec::len), Some(task.layout(&paper_robot()).state_dim()));
    let columns = kind("t.parquet");
    assert_eq!(columns["columns"][1]["not_finite"], 1);
    assert_eq!(columns["columns"][1]["unit"], "m/s");
    assert_eq!(kind("w.safetensors")["parameters"], 9 * 32 + 32 * 25 + 32);
    assert_eq!(kind("e.json")["content"]["success_rate"], 0.98);
    assert!(
        inspect(dir.path(), &Interrupt::default())
            .unwrap_err()
            .to_string()
            .contains("neither a run, a dataset nor a directory of recordings")
    );
}
