//! A full disk, played by a limit on the size of files in a process of its own.

use crate::fixtures::{provenance, table};
use hilt::data::table_file;
use hilt::error::Error;
use hilt::task::built_in::stack;
use std::fs;
use std::path::PathBuf;
use std::process::Command;
use tempfile::tempdir;

/// Where the child writes.
const PLACE: &str = "HILT_TEST_LIMITED_DIR";

#[test]
fn a_full_disk_is_an_error_and_keeps_the_old_file() {
    let dir = tempdir().expect("dir");
    let path = dir.path().join("metrics.parquet");
    table_file::write(&path, &table(10), &provenance("train", &stack())).expect("written");
    let before = fs::read(&path).expect("bytes");
    let this = std::env::current_exe().expect("this test");
    // 16 blocks of 512 or 1024 bytes; without the trap the signal would end the process.
    let limited = "trap '' XFSZ; ulimit -f 16; exec \"$0\" --exact limits::the_child --ignored --nocapture";
    let child = Command::new("sh").arg("-c").arg(limited).arg(this).env(PLACE, dir.path()).output().expect("a shell");
    assert!(child.status.success(), "{}", String::from_utf8_lossy(&child.stdout));
    assert!(String::from_utf8_lossy(&child.stdout).contains("refused as it should"));
    assert_eq!(fs::read(&path).expect("bytes"), before);
    assert_eq!(fs::read_dir(dir.path()).expect("dir").count(), 1, "nothing half-written stays");
}

#[test]
#[ignore = "the child of the test above"]
fn the_child() {
    let dir = PathBuf::from(std::env::var_os(PLACE).expect("started by the test above"));
    match table_file::write(&dir.join("metrics.parquet"), &table(20_000), &provenance("train", &stack())) {
        Err(Error::Io { action: "write", .. }) => println!("refused as it should"),
        other => panic!("{other:?}"),
    }
}
