//! Datasets of many windows, row groups and files.

use super::sizes::Sizes;
use super::*;
use crate::demo::Demo;
use crate::error::Error;
use crate::robot::file::built_in::paper_robot;
use crate::task::built_in::pick_up;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs;

fn episode(number: usize) -> DatasetEpisode {
    let (steps, layout) = (3 + number % 4, pick_up().layout(&paper_robot()));
    let numbers = |n: usize| (0..n).map(|i| (i * i) as f32 * 0.01 - number as f32).collect::<Vec<f32>>();
    let demo = Demo::new(&layout, numbers((steps + 1) * layout.state_dim()), numbers(steps * 9), numbers(steps * 9));
    let demo = demo.expect("a demo");
    DatasetEpisode { source_index: 10 + number as u64, demo, rewards: vec![0.5; steps], success: true }
}

fn fill(dir: &Path, episodes: &Episodes, change: impl Fn(&mut Sizes)) -> Result<()> {
    let (provenance, interrupt) = (Provenance::new("convert", "pick-up", serde_json::json!({}), 0), Interrupt::default());
    let (robot, task) = (paper_robot(), pick_up());
    let mut content = Content::new((&robot, &task), &provenance, &interrupt);
    change(&mut content.form.sizes);
    content.fill(dir, episodes)
}

/// The bytes of every file, by its path.
fn contents(root: &Path) -> BTreeMap<String, Vec<u8>> {
    let (mut found, mut open) = (BTreeMap::new(), vec![root.to_path_buf()]);
    while let Some(dir) = open.pop() {
        for entry in fs::read_dir(dir).expect("readable") {
            let path = entry.expect("entry").path();
            if path.is_dir() {
                open.push(path);
            } else {
                let name = path.strip_prefix(root).expect("below the root").display().to_string();
                found.insert(name, fs::read(&path).expect("readable"));
            }
        }
    }
    found
}

#[test]
fn a_dataset_of_many_files_reads_as_one() {
    let episodes: Vec<_> = (0..5).map(episode).collect();
    let dir = tempfile::tempdir().expect("temporary directory");
    fill(dir.path(), &episodes.as_slice().into(), |sizes| (sizes.file_bytes, sizes.table_rows) = (1, 2)).expect("written");
    assert!(dir.path().join("data/chunk-000/file-004.parquet").is_file());
    assert!(dir.path().join("meta/episodes/chunk-000/file-002.parquet").is_file());
    let found = read(dir.path()).expect("readable");
    assert_eq!(found.demos, episodes.iter().map(|e| e.demo.clone()).collect::<Vec<_>>());
    assert_eq!(found.source_episodes, [10, 11, 12, 13, 14]);
    assert!(contents(dir.path()).keys().all(|name| meta::is_file(Path::new(name))), "all of it may be replaced");
}

#[test]
fn bytes_depend_neither_on_windows_nor_on_threads() {
    let episodes: Vec<_> = (0..23).map(episode).collect();
    let made = |threads: usize, window_frames: usize| {
        let dir = tempfile::tempdir().expect("temporary directory");
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let filled = pool.install(|| {
            fill(dir.path(), &episodes.as_slice().into(), |sizes| {
                (sizes.file_bytes, sizes.table_rows, sizes.window_frames) = (40_000, 4, window_frames);
            })
        });
        filled.expect("written");
        contents(dir.path())
    };
    let expected = made(1, 1 << 14);
    assert!(expected.contains_key("data/chunk-000/file-001.parquet"), "{:?}", expected.keys());
    for (threads, window_frames) in [(1, 1), (2, 1), (2, 10), (3, 1 << 14)] {
        assert!(made(threads, window_frames) == expected, "{threads} threads, windows of {window_frames} frames");
    }
}

#[test]
fn of_several_episodes_that_cannot_be_given_the_first_is_told() {
    let give = |at: usize| if at < 4 { Ok(Cow::Owned(episode(at))) } else { Err(Error::Failed(format!("no episode {at}"))) };
    let steps = (0..9).map(|at| episode(at).demo.len()).collect();
    let dir = tempfile::tempdir().expect("temporary directory");
    let said = fill(dir.path(), &Episodes::new(steps, give), |sizes| sizes.window_frames = 30).expect_err("refused");
    assert_eq!(said.to_string(), "no episode 4");
}
