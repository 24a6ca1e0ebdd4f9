//! Who may talk to a server.

use crate::error::{Error, Result};
use crate::interrupt;
use std::net::{IpAddr, SocketAddr};
use std::path::Path;

/// A shorter token could be guessed.
const LEAST_TOKEN: usize = 16;
/// A longer one would not fit into a handshake.
const MOST_TOKEN: usize = 1024;

/// More than a file with one holds.
const MOST_FILE_BYTES: u64 = 2 * MOST_TOKEN as u64;

/// A secret that clients must know. Only its hash is kept.
#[derive(Clone, Copy)]
pub struct Token(blake3::Hash);

impl std::fmt::Debug for Token {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Token")
    }
}

/// The one line of a file with a token.
///
/// # Errors
/// [`Error::Io`] when it cannot be read; [`Error::Input`] when it holds no token.
pub fn read_token(path: &Path) -> Result<String> {
    let text = interrupt::read_at_most(path, MOST_FILE_BYTES).map_err(|e| Error::io(path, "read", e))?;
    let text = String::from_utf8_lossy(&text);
    let token = text.trim();
    let graphic = token.bytes().all(|b| b.is_ascii_graphic());
    if !graphic || !(LEAST_TOKEN..=MOST_TOKEN).contains(&token.len()) {
        let why = format!("a token is one line of {LEAST_TOKEN} to {MOST_TOKEN} characters without blanks");
        return Err(Error::input(path, format!("holds no token: {why}; openssl rand -hex 32 makes one")));
    }
    Ok(token.to_string())
}

impl Token {
    /// Of this text.
    pub fn new(text: &str) -> Self {
        Token(blake3::hash(text.as_bytes()))
    }

    /// Whether this is the value of an `Authorization` header with the token: `Bearer TOKEN`, or `Api-Key TOKEN` as openpi's client has it.
    /// Hashes are compared in constant time.
    pub fn admits(&self, header: &str) -> bool {
        let (scheme, said) = header.trim().split_once(' ').unwrap_or_default();
        let known = ["Bearer", "Api-Key"].iter().any(|name| name.eq_ignore_ascii_case(scheme));
        let same = Token::new(said.trim()).0 == self.0;
        known && same
    }
}

/// Refuses to be open to other machines without a token.
///
/// # Errors
/// [`Error::Usage`] says what to give.
pub fn check_address(address: IpAddr, token: Option<&Token>) -> Result<()> {
    if address.is_loopback() || token.is_some() {
        return Ok(());
    }
    Err(Error::Usage(format!(
        "--host {address}: other machines could reach it; give --token-file FILE with a secret that clients must send, or leave --host out"
    )))
}

/// Whether a browser's page may ask: only one that the server's own address, of this machine, has served. Other programs send no `Origin`. A
/// page on the internet would otherwise drive the robot of whoever looks at it.
pub fn origin_is_ours(origin: &str, host: &str) -> bool {
    let local = |authority: &str| {
        let name = authority.parse::<SocketAddr>().map(|address| address.ip().is_loopback());
        name.unwrap_or_else(|_| authority == "localhost" || authority.starts_with("localhost:"))
    };
    let authority = origin.strip_prefix("http://").unwrap_or_default();
    authority.eq_ignore_ascii_case(host) && local(&host.to_ascii_lowercase())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_admits_whoever_knows_it() {
        let token = Token::new("0123456789abcdef");
        for header in ["Bearer 0123456789abcdef", "bearer  0123456789abcdef ", "Api-Key 0123456789abcdef"] {
            assert!(token.admits(header), "{header}");
        }
        for header in
            ["", "Bearer", "Bearer 0123456789abcdeF", "Basic 0123456789abcdef", "0123456789abcdef", "Bearer 0123456789abcde"]
        {
            assert!(!token.admits(header), "{header}");
        }
    }

    #[test]
    fn files_without_a_token_are_refused() {
        let dir = tempfile::tempdir().expect("temporary directory");
        let path = dir.path().join("token");
        for (text, good) in [
            ("0123456789abcdef\n", true),
            ("short", false),
            ("", false),
            ("0123456789 abcdef", false),
            ("0123456789abcdef\nmore", false),
        ] {
            std::fs::write(&path, text).expect("written");
            assert_eq!(read_token(&path).is_ok(), good, "{text:?}");
        }
        assert!(read_token(&dir.path().join("none")).is_err());
    }

    #[test]
    fn other_machines_need_a_token_and_pages_of_others_get_nothing() {
        let open: IpAddr = "0.0.0.0".parse().expect("an address");
        assert!(check_address(open, None).is_err() && check_address(open, Some(&Token::new("x"))).is_ok());
        assert!(check_address("::1".parse().expect("an address"), None).is_ok());
        assert!(
            origin_is_ours("http://127.0.0.1:8000", "127.0.0.1:8000")
                && origin_is_ours("http://localhost:8000", "localhost:8000")
        );
        for (origin, host) in [
            ("http://evil.example", "127.0.0.1:8000"),
            ("http://evil.example:8000", "evil.example:8000"),
            ("http://localhost:3000", "localhost:8000"),
            ("null", "127.0.0.1:8000"),
            ("https://127.0.0.1:8000", "127.0.0.1:8000"),
            ("http://localhost.evil.example", "localhost.evil.example"),
        ] {
            assert!(!origin_is_ours(origin, host), "{origin} {host}");
        }
    }
}
