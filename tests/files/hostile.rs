//! Files behind a valid seal that nobody of good will has written, and directories that nobody has made in one go.

use crate::fixtures::{episode, provenance, table, tensors};
use hilt::data::{Provenance, inspect, inspect_text, json_file, recording, seal, table_file, weights};
use hilt::error::Result;
use hilt::interrupt::Interrupt;
use hilt::learn::{Dynamics, Policy};
use hilt::task::built_in::pick_up;
use hilt::tasks::with_layout;
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use tempfile::tempdir;

/// The words of a refusal that takes less than a second.
fn refusal<T>(read: impl FnOnce() -> Result<T>) -> String {
    let begun = std::time::Instant::now();
    let message = read().map(|_| ()).expect_err("refused").to_string();
    assert!(begun.elapsed().as_secs_f64() < 1.0 && message.len() < 600, "{:?}: {message}", begun.elapsed());
    message
}

/// Weights whose header, a text, was changed, with its length and the seal made anew.
fn with_header(whole: &[u8], change: impl Fn(&str) -> String) -> Vec<u8> {
    let end = 8 + u64::from_le_bytes(whole[..8].try_into().expect("eight bytes")) as usize;
    let header = change(std::str::from_utf8(&whole[8..end]).expect("a header is text"));
    let bytes = [&(header.len() as u64).to_le_bytes(), header.as_bytes(), &whole[end..]].concat();
    seal::reseal(bytes).expect("a seal")
}

#[test]
fn weights_are_refused_from_their_header_before_they_take_memory() {
    let path = Path::new("policy.safetensors");
    let whole = weights::encode(path, "policy", &tensors(), &json!({}), &provenance("train", &pick_up())).expect("encoded");
    let says = |bytes: &[u8]| refusal(|| weights::decode(path, bytes));
    assert!(weights::decode(path, &with_header(&whole, str::to_string)).is_ok());
    let long = [&u64::MAX.to_le_bytes()[..], &whole[8..]].concat();
    assert!(says(&seal::reseal(long).expect("a seal")).contains("its header has 18446744073709551615 bytes"));
    let longer = [&(1u64 << 20).to_le_bytes()[..], &whole[8..]].concat();
    assert!(says(&seal::reseal(longer).expect("a seal")).contains("is cut short"));
    // One tensor a thousand times: each would take its memory.
    let name = "\\\"policy.layer_1.bias\\\"";
    let many = with_header(&whole, |header| header.replacen(name, &[name; 1000].join(","), 1));
    assert!(says(&many).contains("names"), "{}", says(&many));
    // Two bytes of text are a list of 160 in memory.
    let heavy = with_header(&whole, |header| {
        let lists = format!("[{}0]", "[],".repeat(4_000_000));
        header.replacen("\\\"meta\\\":{}", &format!("\\\"meta\\\":{lists}"), 1)
    });
    assert!(says(&heavy).contains("bytes of memory"), "{}", says(&heavy));
    let nested =
        with_header(&whole, |header| header.replacen("\\\"meta\\\":{}", &format!("\\\"meta\\\":{}", "[".repeat(100_000)), 1));
    assert!(says(&nested).contains("cannot be read"), "{}", says(&nested));
    let foreign = with_header(&whole, |header| header.replacen("\"hilt\":", "\"format\":", 1));
    assert!(says(&foreign).contains("was not written by hilt"), "{}", says(&foreign));
}

#[test]
fn a_foreign_or_missing_file_is_named_from_its_head() {
    let dir = tempdir().expect("dir");
    let path = dir.path().join("policy.safetensors");
    let read = |bytes: &[u8]| {
        fs::write(&path, bytes).expect("written");
        [refusal(|| weights::read(&path, "policy")), refusal(|| json_file::read(&path))]
    };
    assert!(read(b"").iter().all(|said| said.contains("is empty")));
    let pointer = b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n";
    assert!(read(pointer).iter().all(|said| said.contains("git lfs pull")));
    let [weights_said, json_said] = read(b"one, two\n3, 4\n");
    assert!(weights_said.contains("is no safetensors file; expected weights of hilt"), "{weights_said}");
    assert!(json_said.contains("is no JSON object; expected a summary of hilt evaluate"), "{json_said}");
    // Four gigabytes that take no place on the disk: they are not read.
    let file = fs::File::create(&path).expect("created");
    file.set_len(4 << 30).expect("a file with a hole");
    assert!(refusal(|| weights::read(&path, "policy")).contains("is no safetensors file"));
    std::io::Write::write_all(&mut &file, &with_header(&encoded_weights(), str::to_string)).expect("written");
    assert!(refusal(|| weights::read(&path, "policy")).contains("hilt reads at most"));
}

fn encoded_weights() -> Vec<u8> {
    let made = provenance("train", &pick_up());
    weights::encode(Path::new("w"), "policy", &tensors(), &json!({}), &made).expect("encoded")
}

#[test]
fn inspect_knows_an_artefact_by_its_content_and_not_by_its_ending() {
    let dir = tempdir().expect("dir");
    let (task, origin) = (pick_up(), provenance("simulate", &pick_up()));
    let at = |name: &str| dir.path().join(name);
    fs::write(at("model.pt"), encoded_weights()).expect("written");
    recording::write(&at("episode"), &episode(&task, 0, 3), &origin).expect("written");
    table_file::write(&at("log.csv"), &table(3), &origin).expect("written");
    json_file::write(&at("result.safetensors"), &json!({}), &origin).expect("written");
    let kinds = [("model.pt", "weights"), ("episode", "recording"), ("log.csv", "table"), ("result.safetensors", "summary")];
    for (name, kind) in kinds {
        assert_eq!(inspect(&at(name), &Interrupt::default()).expect(name)["kind"], kind);
    }
    for (name, bytes, said) in [
        ("model.pkl", &b"\x80\x02pytorch"[..], "no artefact of hilt; expected a recording (MCAP)"),
        (
            "model.onnx",
            b"\x08\x07\x12\x07pytorch",
            "is a network for other programs (ONNX); inspect the policy that it was made of",
        ),
    ] {
        fs::write(at(name), bytes).expect("written");
        let message = refusal(|| inspect(&at(name), &Interrupt::default()));
        assert!(message.contains(said), "{message}");
    }
}

#[test]
fn inspect_says_that_recordings_are_of_several_origins() {
    let dir = tempdir().expect("dir");
    let task = pick_up();
    let origin = provenance("simulate", &task);
    let write = |index: u64, origin: &Provenance| {
        recording::write(&dir.path().join(recording::file_name(index)), &episode(&task, index, 4), origin).expect("written");
    };
    let found = || inspect(dir.path(), &Interrupt::default()).expect("recordings");
    (0..3).for_each(|index| write(index, &origin));
    let same = found();
    assert_eq!((&same["provenance"]["seed"], &same["task"], same.get("origins")), (&json!(7), &json!("pick-up"), None));
    write(3, &Provenance { seed: 8, ..origin.clone() });
    write(4, &Provenance { hilt_version: "9.9.9".into(), settings: json!({}), ..origin.clone() });
    write(5, &Provenance { seed: 8, ..origin });
    let mixed = found();
    assert_eq!(mixed.get("provenance"), None);
    assert_eq!((&mixed["episodes"], &mixed["steps"]), (&json!(6), &json!(24)));
    let told: Vec<[&Value; 4]> = mixed["origins"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|o| [&o["recordings"], &o["seed"], &o["hilt_version"], &o["differs_in"]])
        .collect();
    let version = json!(env!("CARGO_PKG_VERSION"));
    assert_eq!(told[0], [&json!(3), &json!(7), &version, &json!("")]);
    assert_eq!(told[1], [&json!(2), &json!(8), &version, &json!("seed")]);
    assert_eq!(told[2], [&json!(1), &json!(7), &json!("9.9.9"), &json!("hilt_version, settings")]);
    assert!(inspect_text(&mixed).contains("origins"));
}

#[test]
fn networks_of_hostile_descriptions_are_refused() {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/pick-up/policy.safetensors"));
    let (tensors, meta, origin) = weights::read(path, "policy").expect("the fixture");
    let layout = |key: &str, value| {
        let mut layout = meta["layout"].clone();
        layout[key] = value;
        layout
    };
    for (key, value) in [
        ("hidden", json!([0])),
        ("horizon_steps", json!(u32::MAX)),
        ("hidden", json!([1u64 << 62])),
        ("layout", json!("pick-up")),
        ("layout", layout("period_s", json!(0))),
        ("layout", layout("state", json!([]))),
        ("layout", layout("aims", json!([{ "object": "block", "target": "block", "offset_m": [0, 0, 0] }]))),
        ("layout", layout("arm", json!({ "joints": [], "tool_m": [0, 0, 0] }))),
    ] {
        let mut hostile = meta.clone();
        hostile[key] = value;
        // Through a file, as it would come in.
        let bytes = weights::encode(path, "policy", &tensors, &hostile, &origin).expect("encoded");
        let (_, tensors, meta, _) = weights::decode(path, &bytes).expect("sealed");
        let message = Policy::from_tensors(&tensors, &meta).expect_err("refused");
        assert!(message.contains(key), "{message}");
        assert!(Dynamics::from_tensors(&tensors, &meta).is_err());
    }
    // A network of an older version does not say its layout, but its task.
    let mut older = meta;
    older.as_object_mut().expect("a table").remove("layout");
    assert!(Policy::from_tensors(&tensors, &older).is_err());
    Policy::from_tensors(&tensors, &with_layout(older)).expect("the task's layout");
}
