//! The beginning of a connection: an HTTP request that is small, soon whole, allowed, and asks for a WebSocket or for the server's health.

use super::access::{Token, origin_is_ours};
use super::paced::{Paced, is_tick};
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};
use tungstenite::handshake::derive_accept_key;

/// Bytes of a request.
const MOST_BYTES: usize = 8 << 10;
/// Headers of a request.
const MOST_HEADERS: usize = 64;
/// Until a request is whole.
const MOST_TIME: Duration = Duration::from_secs(5);
/// How long a caller that is turned away may take to ask and to hear it: all others wait so long.
const TURN_AWAY_TIME: Duration = Duration::from_millis(5);
/// Said to who is turned away.
const NO_ROOM: &str = "503 Service Unavailable";
/// The end of a request's head.
const END: &[u8] = b"\r\n\r\n";

/// Answers the request that opens a connection. With a WebSocket agreed on, the bytes that came behind the request and a place, which only
/// who may come in takes; otherwise it is answered in full and there is nothing more to say.
pub fn shake<S>(stream: &mut Paced, token: Option<&Token>, take: impl FnOnce() -> Option<S>) -> Option<(Vec<u8>, S)> {
    let (head, rest) = read_head(stream)?;
    stream.whole();
    match judge(&head, token) {
        Ok(Asked::Health) => {
            answer(stream, "200 OK", "", "OK\n");
            None
        }
        Ok(Asked::Socket(key)) => {
            let Some(seat) = take() else {
                answer(stream, NO_ROOM, "", "all connections are taken; try again later\n");
                return None;
            };
            let response = format!(
                "HTTP/1.1 101 Switching Protocols\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Accept: {}\r\n\r\n",
                derive_accept_key(key.as_bytes())
            );
            stream.write_all(response.as_bytes()).ok().map(|()| (rest, seat))
        }
        Err(Refused { status, header, why }) => {
            answer(stream, status, header, &format!("{why}\n"));
            None
        }
    }
}

/// Turns a connection away. What it asks is taken first, where it is there: the system drops what was said to who is hung up on unheard.
pub fn turn_away(stream: &mut TcpStream, why: &str) {
    let waits = stream.set_nonblocking(false).and_then(|()| stream.set_read_timeout(Some(TURN_AWAY_TIME)));
    // A caller that does not listen is not waited for.
    let _ = waits.and_then(|()| stream.set_write_timeout(Some(TURN_AWAY_TIME))).and_then(|()| stream.read(&mut [0; MOST_BYTES]));
    answer(stream, NO_ROOM, "", &format!("{why}\n"));
}

fn answer(stream: &mut impl Write, status: &str, header: &str, body: &str) {
    let length = body.len();
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: text/plain; charset=utf-8\r\nContent-Length: {length}\r\n{header}Connection: close\r\n\r\n"
    );
    // Who has gone does not want to know.
    let _ = stream.write_all(format!("{head}{body}").as_bytes());
}

/// The head of a request, and what came behind it; `None` when it does not come in time.
fn read_head(stream: &mut Paced) -> Option<(Vec<u8>, Vec<u8>)> {
    let (mut bytes, mut part, began) = (Vec::new(), [0; 1024], Instant::now());
    loop {
        match stream.read(&mut part) {
            Ok(0) => return None,
            Ok(count) => bytes.extend(&part[..count]),
            Err(e) if is_tick(&e) => {}
            Err(_) => return None,
        }
        if let Some(at) = bytes.windows(END.len()).position(|window| window == END) {
            let rest = bytes.split_off(at + END.len());
            return Some((bytes, rest));
        }
        if bytes.len() > MOST_BYTES {
            answer(stream, "431 Request Header Fields Too Large", "", "the request is too long\n");
            return None;
        }
        if began.elapsed() > MOST_TIME || stream.check().is_err() {
            return None;
        }
    }
}

#[derive(Debug, PartialEq)]
enum Asked {
    Health,
    /// A WebSocket, with its key.
    Socket(String),
}

#[derive(Debug, PartialEq)]
struct Refused {
    status: &'static str,
    header: &'static str,
    why: &'static str,
}

fn judge(head: &[u8], token: Option<&Token>) -> Result<Asked, Refused> {
    let refused = |status, header, why| Err(Refused { status, header, why });
    let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
    let mut request = httparse::Request::new(&mut headers);
    if !request.parse(head).is_ok_and(|parsed| parsed.is_complete()) {
        return refused("400 Bad Request", "", "no readable HTTP request");
    }
    if request.method != Some("GET") {
        return refused("405 Method Not Allowed", "Allow: GET\r\n", "only GET is taken");
    }
    if request.path == Some("/healthz") {
        return Ok(Asked::Health);
    }
    let header = |name: &str| {
        let found = request.headers.iter().find(|header| header.name.eq_ignore_ascii_case(name))?;
        std::str::from_utf8(found.value).ok().map(str::trim)
    };
    match token {
        Some(token) if !header("Authorization").is_some_and(|said| token.admits(said)) => {
            return refused("401 Unauthorized", "WWW-Authenticate: Bearer\r\n", "send the token: Authorization: Bearer TOKEN");
        }
        // A page cannot send a token.
        None if header("Origin").is_some_and(|origin| !origin_is_ours(origin, header("Host").unwrap_or_default())) => {
            return refused("403 Forbidden", "", "pages of other sites are not served");
        }
        _ => {}
    }
    let has =
        |name: &str, word: &str| header(name).is_some_and(|said| said.split(',').any(|w| w.trim().eq_ignore_ascii_case(word)));
    if !has("Upgrade", "websocket") || !has("Connection", "upgrade") || header("Sec-WebSocket-Version") != Some("13") {
        let headers = "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n";
        return refused("426 Upgrade Required", headers, "a WebSocket of version 13 is spoken here");
    }
    match header("Sec-WebSocket-Key") {
        Some(key) if !key.is_empty() => Ok(Asked::Socket(key.into())),
        _ => refused("400 Bad Request", "", "a WebSocket without its key"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOCKET: &str = "GET / HTTP/1.1\r\nHost: 127.0.0.1:8000\r\nUpgrade: websocket\r\nConnection: keep-alive, Upgrade\r\n\
        Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";

    fn judged(more: &str, token: Option<&Token>) -> Result<Asked, &'static str> {
        judge(format!("{SOCKET}{more}\r\n").as_bytes(), token).map_err(|refused| refused.status)
    }

    #[test]
    fn only_who_may_gets_a_socket() {
        let socket = Ok(Asked::Socket("dGhlIHNhbXBsZSBub25jZQ==".into()));
        let token = Token::new("0123456789abcdef");
        assert_eq!(judged("", None), socket);
        assert_eq!(judged("Origin: http://127.0.0.1:8000\r\n", None), socket);
        assert_eq!(judged("Origin: http://evil.example\r\n", None), Err("403 Forbidden"));
        assert_eq!(judged("", Some(&token)), Err("401 Unauthorized"));
        assert_eq!(judged("Authorization: Bearer wrong\r\n", Some(&token)), Err("401 Unauthorized"));
        assert_eq!(judged("authorization: Bearer 0123456789abcdef\r\n", Some(&token)), socket);
    }

    #[test]
    fn other_requests_are_answered_by_what_is_wrong() {
        let status = |head: &str| judge(head.as_bytes(), None).map_err(|refused| refused.status);
        assert_eq!(status("GET /healthz HTTP/1.1\r\n\r\n"), Ok(Asked::Health));
        assert_eq!(status("GET / HTTP/1.1\r\nHost: x\r\n\r\n"), Err("426 Upgrade Required"));
        assert_eq!(status("POST / HTTP/1.1\r\n\r\n"), Err("405 Method Not Allowed"));
        assert_eq!(status("\x00\x01\r\n\r\n"), Err("400 Bad Request"));
        assert_eq!(judged(&"A: b\r\n".repeat(80), None), Err("400 Bad Request"));
        assert_eq!(status(&format!("{SOCKET}\r\n").replace("Version: 13", "Version: 8")), Err("426 Upgrade Required"));
    }
}
