//! Clients that are broken, slow, many, or mean.

use crate::servers::{PATIENCE, Served, Talk, host, observation, row};
use hilt::interrupt::Interrupt;
use hilt::seed::stream;
use hilt::serve::{Array, Host, LineLink, PolicyOptions, Value, encode};
use rand::{Rng, RngExt};
use std::fs;
use std::io::{Cursor, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};
use tungstenite::Message;

/// Messages that are given to a server.
const MESSAGES: usize = 12_000;
/// Memory that a server may have more after them \[bytes\]: what allocators keep, no message.
const MOST_GROWTH: u64 = 48 << 20;

fn memory() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmRSS:")).unwrap_or_default();
    line.split_whitespace().nth(1).and_then(|kib| kib.parse::<u64>().ok()).unwrap_or(0) << 10
}

/// Some bytes of `whole` are others, more, fewer.
fn mutated(whole: &[u8], rng: &mut impl Rng) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    for _ in 0..rng.random_range(1..6) {
        let at = rng.random_range(0..bytes.len().max(1)).min(bytes.len().saturating_sub(1));
        match rng.random_range(0..6) {
            0 if !bytes.is_empty() => bytes[at] = rng.random(),
            // Markers of what promises to be long.
            1 if !bytes.is_empty() => bytes[at] = [0xc6, 0xdb, 0xdd, 0xdf, 0xc9, 0xc1][rng.random_range(0..6)],
            2 => bytes.truncate(at),
            3 => bytes.insert(at, rng.random()),
            4 if bytes.len() > at + 4 => bytes[at..at + 4].fill(0xff),
            _ => {
                let part = bytes[at..].to_vec();
                bytes.extend(part);
            }
        }
    }
    bytes
}

#[test]
fn twelve_thousand_broken_messages_are_each_answered_and_leave_nothing() {
    let (server, mut rng) = (Served::new(4, None), stream(0, "hostile", 0));
    let right = server.talk().ask();
    let (whole, before) = (observation(), memory());
    let (mut refused, mut answered) = (0, 0);
    let mut talk = server.talk();
    for number in 0..MESSAGES {
        let bytes = if number % 10 == 0 {
            (0..rng.random_range(0..200)).map(|_| rng.random()).collect()
        } else {
            mutated(&whole, &mut rng)
        };
        assert!(talk.say(bytes.clone()), "message {number} ended the conversation");
        match talk.hear() {
            Some(Message::Text(_)) => refused += 1,
            Some(Message::Binary(_)) => answered += 1,
            other => panic!("message {number}, {bytes:?}: {other:?}"),
        }
    }
    assert!(refused > MESSAGES / 2 && answered > 0, "{refused} refused, {answered} answered");
    assert_eq!(talk.ask(), right);
    let growth = memory().saturating_sub(before);
    assert!(growth < MOST_GROWTH, "{growth} bytes more");
    server.end();
}

#[test]
fn broken_messages_to_a_world_are_each_answered_and_episodes_go_on() {
    let (server, mut rng) = (Served::world(), stream(2, "hostile", 0));
    let mut talk = server.talk();
    let action = Value::Array(Array::f32(&[9], &[0.1; 9]));
    let step = encode(&Value::map([("step", Value::map([("action", action)]))]));
    let reset = encode(&Value::map([("reset", Value::map([("episode", Value::Int(3))]))]));
    let before = memory();
    for number in 0..MESSAGES {
        let bytes = mutated(if number % 8 == 0 { &reset } else { &step }, &mut rng);
        assert!(talk.say(bytes.clone()), "message {number} ended the conversation");
        assert!(talk.hear().is_some(), "message {number}, {bytes:?}");
    }
    let growth = memory().saturating_sub(before);
    assert!(growth < MOST_GROWTH, "{growth} bytes more");
    assert!(talk.say(reset) && matches!(talk.hear(), Some(Message::Binary(_))));
    server.end();
}

#[test]
fn broken_lines_are_each_answered_and_leave_nothing() {
    let mut rng = stream(3, "hostile", 0);
    let whole = serde_json::json!({ "state": row(), "frame_index": 3, "prompt": "Pick up the block." }).to_string();
    let (mut lines, mut asked) = (Vec::new(), 1);
    for _ in 0..MESSAGES {
        let line: Vec<u8> = mutated(whole.as_bytes(), &mut rng).into_iter().filter(|byte| *byte != b'\n').collect();
        // A line of blanks alone is none.
        asked += usize::from(!line.trim_ascii().is_empty());
        lines.extend(line);
        lines.extend(b"\n");
    }
    lines.extend(format!("{whole}\n").as_bytes());
    let (mut out, before) = (Vec::new(), memory());
    let mut link = LineLink::new(Cursor::new(lines), &mut out, &Interrupt::default()).expect("a thread");
    host(PolicyOptions::default()).converse(&mut link, 0).expect("no interrupt");
    drop(link);
    let answers: Vec<&[u8]> = out.split(|byte| *byte == b'\n').collect();
    // Metadata come first, and nothing behind the last end of a line.
    assert_eq!(answers.len(), 1 + asked + 1);
    let last = String::from_utf8_lossy(answers[answers.len() - 2]);
    assert!(last.contains("\"actions\""), "{last}");
    let growth = memory().saturating_sub(before);
    assert!(growth < MOST_GROWTH, "{growth} bytes more");
}

#[test]
fn noise_in_place_of_a_conversation_ends_that_connection_alone() {
    let (server, mut rng) = (Served::new(64, None), stream(1, "hostile", 0));
    let request = format!(
        "GET / HTTP/1.1\r\nHost: {}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n",
        server.address
    );
    for number in 0..300 {
        let Ok(mut stream) = TcpStream::connect(server.address) else { panic!("connection {number} is refused") };
        let mut bytes = if number % 2 == 0 { mutated(request.as_bytes(), &mut rng) } else { request.as_bytes().to_vec() };
        bytes.extend((0..rng.random_range(1..300)).map(|_| rng.random::<u8>()));
        // It may have been hung up.
        let _ = stream.write_all(&bytes);
    }
    let mut talk =
        (0..100).find_map(|_| Talk::with(server.address, None).ok().or_else(|| pause(50))).expect("there is room again");
    assert_eq!(talk.ask().len(), 9);
    server.end();
}

fn pause<T>(ms: u64) -> Option<T> {
    std::thread::sleep(Duration::from_millis(ms));
    None
}

#[test]
fn a_message_that_is_too_large_is_refused_and_ends_the_conversation() {
    let server = Served::new(4, None);
    let mut talk = server.talk();
    // What is behind the limit is not read: the system may already refuse to send it.
    talk.say(vec![0xc0; (4 << 20) + 1]);
    assert!(!matches!(talk.hear(), Some(Message::Binary(_))));
    assert!(talk.hear().is_none());
    assert_eq!(server.talk().ask().len(), 9);
}

#[test]
fn who_is_slow_or_does_not_read_holds_up_nobody_and_is_hung_up() {
    let server = Served::new(8, None);
    let mut half = TcpStream::connect(server.address).expect("a connection");
    half.write_all(b"GET / HTTP/1.1\r\nHost: x\r\n").expect("written");
    // The head of a frame of 100 bytes, and no more.
    let mut stuck = server.talk();
    stuck.0.get_mut().write_all(&[0x82, 0xe4, 1, 2, 3, 4, 5]).expect("written");
    // Asks without end and never reads.
    let deaf = server.talk();
    let (mut hurried, whole) = (deaf.0.get_ref().try_clone().expect("a handle"), observation());
    let mut frame = vec![0x82, 0xfe];
    frame.extend((whole.len() as u16).to_be_bytes());
    frame.extend([0; 4]);
    frame.extend(&whole);
    let many = frame.repeat(100);
    let deaf_is_hung_up = std::thread::spawn(move || {
        hurried.set_write_timeout(Some(PATIENCE)).expect("set");
        (0..100_000).any(|_| hurried.write_all(&many).is_err())
    });

    let began = Instant::now();
    let mut talk = server.talk();
    let mut slowest = Duration::ZERO;
    while began.elapsed() < Duration::from_secs(2) {
        let asked = Instant::now();
        assert_eq!(talk.ask().len(), 9);
        slowest = slowest.max(asked.elapsed());
    }
    assert!(slowest < Duration::from_secs(1), "an answer took {slowest:?}");

    half.set_read_timeout(Some(PATIENCE)).expect("set");
    assert!(matches!(half.read(&mut [0; 8]), Ok(0) | Err(_)), "half a handshake is not answered");
    assert!((4..15).contains(&began.elapsed().as_secs()), "after {:?}", began.elapsed());
    assert!(deaf_is_hung_up.join().expect("no panic"));
    server.end();
    drop(deaf);
}

#[test]
fn there_is_room_for_so_many_and_again_when_one_leaves() {
    let server = Served::new(2, None);
    let (first, mut second) = (server.talk(), server.talk());
    let refused = Talk::with(server.address, None).err().expect("no room");
    assert!(refused.contains("503"), "{refused}");
    drop(first);
    let mut third = (0..100).find_map(|_| Talk::with(server.address, None).ok().or_else(|| pause(20))).expect("room again");
    assert_eq!(second.ask(), third.ask());
}

/// Regression: connections that never said who they were took all places from those who may.
#[test]
fn who_has_not_shown_the_token_takes_no_place() {
    let server = Served::new(2, Some("a secret of enough letters"));
    let silent: Vec<TcpStream> = (0..30).map(|_| TcpStream::connect(server.address).expect("a connection")).collect();
    for mut half in &silent[..15] {
        half.write_all(b"GET / HTTP/1.1\r\nHost: x\r\n").expect("written");
    }
    let header = Some(("Authorization", "Bearer a secret of enough letters"));
    let mut talk = Talk::with(server.address, header).expect("admitted");
    assert_eq!(talk.ask().len(), 9);
    server.end();
}

#[test]
fn who_is_silent_for_long_gives_way_where_all_places_are_taken() {
    let patience = Duration::from_millis(600);
    let server = Served::patient(1, patience);
    let mut silent = server.talk();
    assert_eq!(silent.ask().len(), 9);
    assert!(Talk::with(server.address, None).is_err_and(|why| why.contains("503")));
    pause::<()>(2 * patience.as_millis() as u64);
    assert_eq!(server.talk().ask().len(), 9);
    assert!(matches!(silent.hear(), Some(Message::Text(why)) if why.contains("connect again")) && silent.hear().is_none());
    server.end();
}

#[test]
fn a_server_with_a_token_talks_to_those_who_know_it() {
    let server = Served::new(4, Some("a secret of enough letters"));
    for header in [None, Some(("Authorization", "Bearer another secret of letters")), Some(("Origin", "http://localhost"))] {
        let refused = Talk::with(server.address, header).err().expect("refused");
        assert!(refused.contains("401"), "{refused}");
    }
    for scheme in ["Bearer", "Api-Key"] {
        let header = format!("{scheme} a secret of enough letters");
        assert_eq!(Talk::with(server.address, Some(("Authorization", &header))).expect("admitted").ask().len(), 9);
    }
}

#[test]
fn pages_of_others_are_refused_and_health_is_told() {
    let server = Served::new(4, None);
    let refused = Talk::with(server.address, Some(("Origin", "http://evil.example"))).err().expect("refused");
    assert!(refused.contains("403"), "{refused}");
    let mut stream = TcpStream::connect(server.address).expect("a connection");
    stream.write_all(b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n").expect("written");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("an answer");
    assert!(answer.starts_with("HTTP/1.1 200 OK\r\n") && answer.ends_with("\r\n\r\nOK\n"), "{answer}");
}

#[test]
fn an_interrupt_ends_open_conversations_and_frees_the_port() {
    let server = Served::new(4, None);
    let (mut idle, address) = (server.talk(), server.address);
    let began = Instant::now();
    server.end();
    assert!(began.elapsed() < Duration::from_secs(2), "after {:?}", began.elapsed());
    assert!(idle.hear().is_none());
    TcpListener::bind(address).expect("the port is free");
}
