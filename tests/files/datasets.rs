//! LeRobot datasets: exact, deterministic, checked.

use crate::fixtures::{contents, episode, provenance};
use crate::refuses_damage;
use arrow_array::cast::AsArray;
use arrow_array::types::Float32Type;
use arrow_array::{Array, ArrayRef, FixedSizeListArray, Float32Array, RecordBatch};
use hilt::data::dataset::{self, Dataset, DatasetEpisode};
use hilt::data::inspect;
use hilt::demo::{Demo, Episode};
use hilt::interrupt::Interrupt;
use hilt::robot::file::built_in::paper_robot;
use hilt::task::built_in::{of_the_paper, pick_up, stack};
use hilt::tasks::Task;
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tempfile::{TempDir, tempdir};

fn episodes(task: &Arc<Task>) -> Vec<Episode> {
    [(0, 5), (3, 1), (4, 12)].map(|(index, steps)| episode(task, index, steps)).into()
}

fn demos(episodes: &[Episode]) -> Vec<Demo> {
    episodes.iter().map(|e| e.to_demo().expect("a demo")).collect()
}

fn write(root: &Path, task: &Arc<Task>) -> Vec<Demo> {
    let episodes = episodes(task);
    let demos = demos(&episodes);
    let rows: Vec<DatasetEpisode> = episodes.iter().zip(&demos).map(|(e, d)| DatasetEpisode::of(e, d.clone())).collect();
    dataset::write(root, (&paper_robot(), task), &rows.as_slice().into(), &provenance("convert", task)).expect("written");
    demos
}

fn written(task: &Arc<Task>) -> (TempDir, PathBuf) {
    let dir = tempdir().expect("dir");
    let root = dir.path().join("train");
    write(&root, task);
    (dir, root)
}

fn refusal(root: &Path) -> String {
    dataset::read(root).expect_err("must be refused").to_string()
}

#[test]
fn datasets_round_trip_exactly_with_the_last_state() {
    for task in of_the_paper() {
        let dir = tempdir().expect("dir");
        let (here, there) = (dir.path().join("train"), dir.path().join("elsewhere/train"));
        let demos = write(&here, &task);
        write(&there, &task);
        assert_eq!(contents(&here), contents(&there));
        let Dataset { demos: found, rewards, successes, source_episodes, fps, provenance: origin, .. } =
            dataset::read_for(&here, &task.name).expect("readable");
        assert_eq!(found, demos);
        assert_eq!((source_episodes, successes, fps), (vec![0, 3, 4], vec![true; 3], 20));
        assert_eq!(rewards[0], [0.0, 0.0, 0.1, 0.0, 0.0], "the reward of state 3 belongs to action 2");
        assert_eq!(origin, provenance("convert", &task));
        let told = inspect(&here, &Interrupt::default()).expect("a dataset");
        assert_eq!((&told["kind"], &told["frames"]), (&"dataset".into(), &18.into()));
    }
}

#[test]
fn damage_to_any_file_is_refused() {
    let (_dir, root) = written(&stack());
    for name in ["meta/info.json", "meta/stats.json", "meta/tasks.parquet"] {
        refuses_damage(&root.join(name), || dataset::read(&root));
    }
    for name in ["meta/episodes/chunk-000/file-000.parquet", "data/chunk-000/file-000.parquet"] {
        refuses_damage(&root.join(name), || dataset::read(&root));
    }
}

#[test]
fn missing_files_are_named() {
    for name in ["meta/stats.json", "meta/tasks.parquet", "data/chunk-000/file-000.parquet"] {
        let (_dir, root) = written(&pick_up());
        fs::remove_file(root.join(name)).expect("removed");
        let message = refusal(&root);
        assert!(message.contains(name) && message.contains("is missing"), "{message}");
    }
    let (dir, root) = written(&pick_up());
    let message = refusal(dir.path());
    assert!(message.contains("holds the two datasets train and validation"), "{message}");
    fs::remove_file(root.join("meta/info.json")).expect("removed");
    assert!(refusal(&root).contains("meta/info.json is missing"));
    assert!(refusal(&root.join("nowhere")).contains("does not exist"));
}

#[test]
fn edits_of_info_are_named_for_what_they_are() {
    let cases = [
        ("\"v3.0\"", "\"v2.1\"", "codebase_version \"v2.1\", hilt reads \"v3.0\""),
        ("\"fps\": 20", "\"fps\": 30", "30 frames per second"),
        ("\"schema_version\": 1", "\"schema_version\": 9", "schema version 9"),
        ("\"task\": \"pick-up\"", "\"task\": \"stack\"", "its layout is of pick-up, its provenance of stack"),
        ("\"next.reward\"", "\"next.regret\"", "does not declare the feature next.reward"),
        ("\"total_frames\": 18", "\"total_frames\": 19", "does not match its seal"),
    ];
    for (old, new, expected) in cases {
        let (_dir, root) = written(&pick_up());
        let path = root.join("meta/info.json");
        let text = fs::read_to_string(&path).expect("text");
        assert!(text.contains(old), "{old}");
        fs::write(&path, text.replace(old, new)).expect("edited");
        let message = refusal(&root);
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn a_dataset_of_another_task_is_refused() {
    let (_dir, root) = written(&pick_up());
    let message = dataset::read_for(&root, "stack").unwrap_err().to_string();
    assert!(message.contains("pick-up (states of 25 numbers), not of stack (32)"), "{message}");
}

/// Rewrites the data file as another program would, with one number changed.
fn rewrite(root: &Path, column: &str, row: usize, entry: usize, value: f32) {
    let path = root.join("data/chunk-000/file-000.parquet");
    let file = fs::File::open(&path).expect("file");
    let reader = ParquetRecordBatchReaderBuilder::try_new(file).expect("parquet").build().expect("reader");
    let batches: Vec<RecordBatch> = reader.map(|b| b.expect("batch")).collect();
    let mut writer = ArrowWriter::try_new(fs::File::create(&path).expect("file"), batches[0].schema(), None).expect("writer");
    for batch in &batches {
        let at = batch.schema().index_of(column).expect("column");
        let list = batch.column(at).as_fixed_size_list();
        let mut values = list.values().as_primitive::<Float32Type>().values().to_vec();
        values[row * list.value_length() as usize + entry] = value;
        let field = match list.data_type() {
            arrow_schema::DataType::FixedSizeList(field, _) => Arc::clone(field),
            other => panic!("{other}"),
        };
        let mut columns = batch.columns().to_vec();
        columns[at] =
            Arc::new(FixedSizeListArray::new(field, list.value_length(), Arc::new(Float32Array::from(values)), None)) as ArrayRef;
        writer.write(&RecordBatch::try_new(batch.schema(), columns).expect("batch")).expect("written");
    }
    writer.close().expect("closed");
}

#[test]
fn what_another_program_put_into_the_data_is_named() {
    let cases = [
        ("observation.state", f32::NAN, "column observation.state, row 7, entry 2: NaN is not a finite number"),
        ("action", f32::INFINITY, "column action, row 7, entry 2: inf is not a finite number"),
        ("observation.state", 0.25, "next.observation of frame 0 is not the observation of the frame after it"),
        ("action", 0.25, "was rewritten by another program"),
    ];
    for (column, value, expected) in cases {
        let (_dir, root) = written(&pick_up());
        rewrite(&root, column, 7, 2, value);
        let message = refusal(&root);
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn nothing_is_written_without_episodes_or_over_foreign_files() {
    let (_dir, root) = written(&pick_up());
    let before = contents(&root);
    let origin = provenance("convert", &pick_up());
    let message = dataset::write(&root, (&paper_robot(), &pick_up()), &[].as_slice().into(), &origin).unwrap_err().to_string();
    assert!(message.contains("at least one episode"), "{message}");
    assert_eq!(contents(&root), before);
    let (others, home) = (episodes(&stack()), root.join("data"));
    let demos = demos(&others);
    let rows: Vec<DatasetEpisode> = others.iter().zip(&demos).map(|(e, d)| DatasetEpisode::of(e, d.clone())).collect();
    assert!(
        dataset::write(&root, (&paper_robot(), &pick_up()), &rows.as_slice().into(), &origin)
            .unwrap_err()
            .to_string()
            .contains("is of stack")
    );
    assert!(
        dataset::write(&home, (&paper_robot(), &stack()), &rows.as_slice().into(), &origin)
            .unwrap_err()
            .to_string()
            .contains("chunk-000")
    );
    assert_eq!(contents(&root), before);
}
