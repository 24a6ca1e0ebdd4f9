//! A name for what was learned from a dataset of another program.

use super::Info;
use std::path::{Component, Path};

/// Most characters of a name.
const LONGEST: usize = 64;
/// Where nothing else can be said.
const NAMELESS: &str = "dataset";

/// A legal name of a task, of the dataset's directory, or of its robot where that says nothing: small letters, digits, `-` and `_`.
pub fn task_name(dir: &Path, info: &Info) -> String {
    let last = |path: &Path| match path.components().next_back() {
        Some(Component::Normal(name)) => name.to_str().map(legal),
        _ => None,
    };
    let of_directory = last(dir).or_else(|| last(&dir.canonicalize().ok()?)).filter(|name| !name.is_empty());
    let of_robot = || info.robot_type.as_deref().map(legal).filter(|name| !name.is_empty());
    of_directory.or_else(of_robot).unwrap_or_else(|| NAMELESS.into())
}

fn legal(text: &str) -> String {
    let one = |c: char| if c.is_ascii_alphanumeric() || c == '_' { c.to_ascii_lowercase() } else { '-' };
    let name: String = text.chars().map(one).take(LONGEST).collect();
    name.trim_matches('-').into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_text_becomes_a_legal_name() {
        for (text, name) in [("Pick Up.v2", "pick-up-v2"), ("so100_test", "so100_test"), ("\u{e4}\u{f6}", ""), ("..", "")] {
            assert_eq!(legal(text), name);
        }
        assert_eq!(legal(&"A".repeat(100)).len(), LONGEST);
    }
}
