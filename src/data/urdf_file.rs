//! A URDF for programs that are not hilt. Its first line says that hilt wrote it: such a file may be replaced, another not.

use crate::robot::urdf::XML_LINE;

/// How a file that hilt wrote begins.
pub const MARK: &str = "<!-- by hilt ";

/// The bytes of the file. XML knows no comment before its declaration, which a document in UTF-8 need not have.
pub fn encode(document: &str) -> Vec<u8> {
    let rest = document.strip_prefix(XML_LINE).unwrap_or(document);
    format!("{MARK}{} -->\n{rest}", env!("CARGO_PKG_VERSION")).into_bytes()
}
