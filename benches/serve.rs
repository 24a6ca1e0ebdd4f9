//! How long a policy that is served takes to answer, on this machine: `cargo bench --bench serve -- ws://127.0.0.1:8000`, against a running
//! `hilt serve`. Or, of a `hilt serve-env`, how many control steps a second it takes.

use hilt::serve::{Array, Value, decode, encode};
use std::net::TcpStream;
use std::time::Instant;
use tungstenite::{Message, WebSocket, client};

/// Questions whose answers are not counted: caches warm up.
const WARM_UP: usize = 1_000;
const QUESTIONS: usize = 20_000;

fn ask(socket: &mut WebSocket<TcpStream>, question: &[u8]) -> Vec<u8> {
    socket.send(Message::binary(question.to_vec())).expect("the server takes it");
    match socket.read().expect("the server answers") {
        Message::Binary(answer) => answer.to_vec(),
        other => panic!("refused: {other}"),
    }
}

fn main() {
    let Some(address) = std::env::args().find(|argument| argument.starts_with("ws://")) else {
        println!(
            "serve: give the address of a running `hilt serve` or `hilt serve-env`: cargo bench --bench serve -- ws://HOST:PORT"
        );
        return;
    };
    let stream = TcpStream::connect(address.trim_start_matches("ws://")).expect("a server");
    stream.set_nodelay(true).expect("set");
    let (mut socket, _) = client(address.as_str(), stream).expect("a conversation");
    let metadata = socket.read().expect("metadata").into_data();
    let metadata = decode(&metadata).expect("metadata");
    let zeros = |names: Option<&Value>| match names {
        Some(Value::List(names)) => Value::Array(Array::f32(&[names.len()], &vec![0.0; names.len()])),
        _ => panic!("the metadata name no entries"),
    };
    let is_policy = metadata.get("kind").and_then(Value::as_text) == Some("policy");
    let reset = encode(&Value::map([("reset", Value::map([]))]));
    let question = if is_policy {
        let Some(Value::Map(keys)) = metadata.get("keys") else { panic!("the metadata have no keys") };
        encode(&Value::Map(keys.iter().map(|(name, names)| (name.clone(), zeros(Some(names)))).collect()))
    } else {
        ask(&mut socket, &reset);
        encode(&Value::map([("step", Value::map([("action", zeros(metadata.get("actions")))]))]))
    };
    let (mut times_ms, mut began) = (Vec::with_capacity(QUESTIONS), Instant::now());
    for number in 0..WARM_UP + QUESTIONS {
        if number == WARM_UP {
            (began, times_ms) = (Instant::now(), Vec::with_capacity(QUESTIONS));
        }
        let asked = Instant::now();
        let answer = ask(&mut socket, &question);
        times_ms.push(asked.elapsed().as_secs_f64() * 1e3);
        let over = |key: &str| decode(&answer).expect("an answer").get(key) == Some(&Value::Bool(true));
        if !is_policy && (over("terminated") || over("truncated")) {
            ask(&mut socket, &reset);
        }
    }
    let rate = QUESTIONS as f64 / began.elapsed().as_secs_f64();
    times_ms.sort_by(f64::total_cmp);
    let at = |share: f64| times_ms[(share * (QUESTIONS - 1) as f64) as usize];
    println!("{address}: {QUESTIONS} answers, {rate:.0} a second, p50 {:.3} ms, p99 {:.3} ms", at(0.5), at(0.99));
}
