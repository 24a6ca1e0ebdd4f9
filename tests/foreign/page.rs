//! The commands of docs/your-own-data.md, as they stand there.

use crate::made::{TINY, done, fixture};
use std::fs;
use std::path::Path;
use tempfile::tempdir;

/// The commands of the blocks that are meant to be run.
fn commands(page: &str) -> Vec<Vec<&str>> {
    let blocks = page.split("```sh\n").skip(1).map(|rest| rest.split("```").next().unwrap_or_default());
    blocks.flat_map(str::lines).map(|line| line.split_whitespace().collect()).collect()
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("made");
    for entry in fs::read_dir(from).expect("readable") {
        let path = entry.expect("an entry").path();
        let place = to.join(path.file_name().expect("a name"));
        if path.is_dir() {
            copy(&path, &place);
        } else {
            fs::copy(&path, place).expect("copied");
        }
    }
}

#[test]
fn the_commands_of_the_page_work() {
    let page = include_str!("../../docs/your-own-data.md");
    let dir = tempdir().expect("dir");
    copy(&fixture("lerobot"), &dir.path().join("my-data"));
    let all = commands(page);
    assert!(all.len() > 12, "{all:?}");
    for words in all {
        let (program, words) = words.split_first().expect("a command");
        assert_eq!(*program, "hilt");
        // The same commands in a second.
        let learns = ["pretrain", "train"].contains(&words[0]);
        let tiny = if learns { &TINY[..] } else { &[] };
        done(dir.path(), &[words, tiny].concat());
    }
    assert!(
        dir.path().join("runs/my-data/policy.safetensors").is_file()
            && dir.path().join("runs/parts/policy-bc.safetensors").is_file()
    );
}
