//! What is refused: in plain words, with the exit code of its kind, and without loss.

use crate::servers::{HILT, Process, policy_file};
use hilt::serve::{Array, Value, encode};
use std::fs;
use std::net::TcpListener;
use std::path::Path;
use std::process::{Command, Output};
use std::thread;
use tungstenite::{Message, accept};

fn hilt(arguments: &[&str]) -> Output {
    Command::new(HILT).args(arguments).output().expect("the binary runs")
}

/// Exit code, nothing on stdout, one error with all of `says`.
fn refused(arguments: &[&str], code: i32, says: &[&str]) {
    let output = hilt(arguments);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {stderr}");
    assert!(output.stdout.is_empty(), "{arguments:?} printed to stdout");
    assert_eq!(stderr.lines().filter(|line| line.starts_with("error: ")).count(), 1, "{arguments:?}: {stderr}");
    for part in says {
        assert!(stderr.contains(part), "{arguments:?} should say \"{part}\": {stderr}");
    }
}

fn policy() -> String {
    policy_file().to_str().expect("UTF-8 path").to_string()
}

#[test]
fn a_server_does_not_start_where_it_must_not() {
    let policy = policy();
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("known").port().to_string();
    refused(&["serve", &policy, "--port", &port], 1, &["cannot listen on 127.0.0.1:", "another --port, or --port 0"]);
    refused(&["serve-env", "--task", "stack", "--port", &port], 1, &["cannot listen on", "another --port"]);
    refused(&["serve", &policy, "--host", "0.0.0.0"], 2, &["--host 0.0.0.0", "--token-file"]);
    refused(&["serve-env", "--task", "stack", "--host", "::"], 2, &["--host ::", "--token-file"]);
    refused(&["serve", &policy, "--host", "203.0.113.7", "--token-file", &short_token()], 1, &["holds no token", "openssl rand"]);
    refused(&["serve", &policy, "--stdio", "--port", "7"], 2, &["--stdio", "--port"]);
    refused(&["serve-env"], 2, &["which task?"]);
    refused(&["serve-env", "--task", "stack", "--horizon", "0x"], 2, &["--horizon"]);
}

fn short_token() -> String {
    let path = std::env::temp_dir().join(format!("hilt-token-{}", std::process::id()));
    fs::write(&path, "short\n").expect("written");
    path.to_str().expect("UTF-8 path").into()
}

#[test]
fn what_is_no_policy_is_not_served() {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures");
    let plans = fixtures.join("pick-up/plans.parquet");
    refused(&["serve", plans.to_str().expect("UTF-8 path")], 1, &["plans.parquet", "no safetensors file"]);
    refused(&["serve", "nowhere.safetensors"], 1, &["nowhere.safetensors"]);
    refused(&["serve", "planner"], 2, &["cannot be served", "hilt evaluate --policy planner"]);
    refused(&["serve", &policy(), "--robot-rate", "0"], 2, &["--robot-rate 0", "0.1 to 10000 Hz"]);
    refused(&["serve", &policy(), "--robot-rate", "NaN"], 2, &["--robot-rate NaN"]);
    refused(&["serve", &policy(), "--watchdog", "0"], 2, &["--watchdog"]);
    refused(&["serve", &policy(), "--robot", "panda"], 2, &["was made by robot jaco", "panda is another robot"]);
    refused(&["serve", &policy(), "--seed", "1"], 2, &["--stochastic"]);
}

/// Evaluates what is served at `address`.
fn evaluated(address: &str, more: &[&str]) -> Output {
    let fixed = ["evaluate", "--task", "pick-up", "--episodes", "2", "--set", "evaluate.horizon_steps=5", "--policy", address];
    hilt(&[&fixed, more].concat())
}

fn not_evaluated(address: &str, says: &[&str]) {
    let dir = tempfile::tempdir().expect("a directory");
    let out = dir.path().join("evaluation.json");
    let out = out.to_str().expect("UTF-8 path");
    assert_eq!(evaluated_natively(out).status.code(), Some(0));
    let before = fs::read(out).expect("written");
    let output = evaluated(address, &["--out", out]);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(matches!(output.status.code(), Some(1 | 2)) && output.stdout.is_empty(), "{address}: {stderr}");
    for part in says {
        assert!(stderr.contains(part), "{address} should say \"{part}\": {stderr}");
    }
    assert_eq!(fs::read(out).expect("still there"), before, "{address}: the evaluation before it is lost");
    assert_eq!(fs::read_dir(dir.path()).expect("readable").count(), 2, "{address}: something is left behind");
}

fn evaluated_natively(out: &str) -> Output {
    evaluated(&policy(), &["--out", out])
}

/// A server that begins every conversation with `metadata` and answers everything with `answer`; its address.
fn fake(metadata: Message, answer: Message) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = format!("ws://{}", listener.local_addr().expect("known"));
    thread::spawn(move || {
        for stream in listener.incoming() {
            let (metadata, answer) = (metadata.clone(), answer.clone());
            thread::spawn(move || {
                let mut socket = accept(stream.expect("a caller")).expect("a handshake");
                // The other end may have gone.
                let _ = socket.send(metadata);
                while socket.read().is_ok_and(|message| !message.is_close()) && socket.send(answer.clone()).is_ok() {}
            });
        }
    });
    address
}

fn answers(value: &Value) -> String {
    fake(Message::binary(encode(&Value::map([]))), Message::binary(encode(value)))
}

fn actions(shape: &[usize], value: f32) -> Value<'static> {
    let numbers = vec![value; shape.iter().product()];
    Value::map([("actions", Value::Array(Array::f32(shape, &numbers)))])
}

#[test]
fn a_server_that_is_none_or_another_is_said() {
    // A port that was free a moment ago may be another test's by now; nobody listens on this one.
    not_evaluated("ws://127.0.0.1:1", &["nobody answers", "is the server running"]);
    not_evaluated("wss://127.0.0.1:1", &["hilt speaks no TLS"]);
    not_evaluated("http://127.0.0.1:1", &["ws://HOST:PORT"]);
    let world = Process::new(&["serve-env", "--task", "pick-up"]);
    not_evaluated(&world.address, &["serves an environment"]);
    let file = policy();
    let other = Process::new(&["serve", &file]);
    refused(&["evaluate", "--task", "stack", "--policy", &other.address], 1, &["pick-up", "stack", "give --task"]);
    refused(&["evaluate", "--task", "pick-up", "--policy", &other.address, "--stochastic"], 2, &["--stochastic", "hilt serve"]);
    refused(&["evaluate", "--task", "pick-up", "--policy", &file, "--actions-each", "2"], 2, &["--actions-each", "ws://"]);
}

#[test]
fn answers_that_are_none_end_an_evaluation_without_loss() {
    let (map, good) = (|| Message::binary(encode(&Value::map([]))), Message::binary(encode(&actions(&[1, 9], 0.0))));
    not_evaluated(&fake(Message::binary(vec![0xc1]), good.clone()), &["no msgpack", "serves no policy"]);
    not_evaluated(&fake(Message::binary(encode(&Value::Int(3))), good.clone()), &["a number instead of a map"]);
    not_evaluated(&fake(Message::text("no"), good), &["refuses: no"]);
    not_evaluated(&fake(map(), Message::binary(b"\xdf\xff\xff\xff\xff".to_vec())), &["no msgpack", "cut short"]);
    not_evaluated(&fake(map(), Message::text("Traceback\n  File x\nKeyError: 'image'")), &["refuses:", "KeyError: 'image'"]);
    not_evaluated(&answers(&Value::map([("action_plan", Value::Nil)])), &["without \"actions\""]);
    not_evaluated(&answers(&actions(&[1, 7], 0.0)), &["shape [1, 7]", "rows of 9 numbers"]);
    not_evaluated(&answers(&actions(&[2, 2, 9], 0.0)), &["shape [2, 2, 9]"]);
    not_evaluated(&answers(&Value::map([("actions", Value::text("left"))])), &["text instead of numbers"]);
}

#[test]
fn commands_that_are_no_numbers_are_counted_by_their_class() {
    for answer in [actions(&[1, 9], f32::NAN), actions(&[9], f32::INFINITY)] {
        let output = evaluated(&answers(&answer), &["--json"]);
        let summary: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!(summary["failures"]["command_not_finite"], 2, "{summary}");
    }
}

#[test]
fn answers_of_several_actions_are_executed_in_order() {
    let output = evaluated(&answers(&actions(&[4, 9], 0.1)), &["--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(summary["episode_steps"]["p50"], 5, "{summary}");
}
