//! Texts for programs that are not hilt. Their first line says that hilt wrote them: such a file may be replaced, another not.

use crate::robot::write_urdf::XML_LINE;

/// How a URDF of hilt begins.
const URDF: &str = "<!-- by hilt ";
/// How a manual page of hilt begins.
const MAN: &str = ".\\\" by hilt ";

/// Whether a file that begins so is a text that hilt wrote.
pub(super) fn is_ours(head: &[u8]) -> bool {
    [URDF, MAN].iter().any(|mark| head.starts_with(mark.as_bytes()))
}

/// The bytes of a URDF. XML knows no comment before its declaration, which a document in UTF-8 need not have.
pub fn urdf(document: &str) -> Vec<u8> {
    let rest = document.strip_prefix(XML_LINE).unwrap_or(document);
    format!("{URDF}{} -->\n{rest}", env!("CARGO_PKG_VERSION")).into_bytes()
}

/// The bytes of a manual page.
pub fn man(page: &[u8]) -> Vec<u8> {
    [format!("{MAN}{}\n", env!("CARGO_PKG_VERSION")).as_bytes(), page].concat()
}
