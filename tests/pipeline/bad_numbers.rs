//! Files that are whole and sealed, but whose content cannot be used: numbers that are none, networks of other sizes.

use crate::runs::{Run, hilt, text};
use arrow_array::cast::AsArray;
use arrow_array::types::Float32Type;
use arrow_array::{Array, ArrayRef, FixedSizeListArray, Float32Array, RecordBatch};
use hilt::data::{recording, seal, table_file, weights};
use hilt::demo::Step;
use hilt::table::Values;
use hilt::tasks::FailureClass;
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use std::fs;
use std::path::Path;
use std::sync::Arc;

#[test]
fn plans_with_a_number_that_is_none_are_refused() {
    let run = Run::finished();
    let path = run.at("plans.parquet");
    let (mut table, origin) = table_file::read(&path).expect("plans");
    let column = table.columns.iter_mut().find(|c| c.name.ends_with("dq_rad_s")).expect("a velocity");
    let Values::F64(values) = &mut column.values else { panic!("velocities are 64-bit floats") };
    values[7] = f64::NAN;
    table_file::write(&path, &table, &origin).expect("written");
    run.refuses(run.words("simulate"), &["plans.parquet", "row 7", "NaN, not a finite number"]);
}

#[test]
fn recordings_with_a_number_that_is_none_are_refused() {
    let harms: [fn(&mut Step); 2] = [|s| s.state.dq[2] = f64::NAN, |s| s.commanded[4] = f64::INFINITY];
    for harm in harms {
        let run = Run::finished();
        let path = run.at("recordings/episode-00001.mcap");
        let (mut episode, origin) = recording::read(&path).expect("a recording");
        harm(&mut episode.steps[5]);
        recording::write(&path, &episode, &origin).expect("written");
        run.refuses(run.words("convert"), &["episode-00001.mcap", "step 5", "not a finite number"]);
    }
}

#[test]
fn datasets_with_a_number_that_is_none_are_refused() {
    for root in ["dataset/train", "dataset/validation"] {
        for (column, value) in [("observation.state", f32::NAN), ("action", f32::NEG_INFINITY)] {
            let run = Run::finished();
            forge(&run.at(root), column, 11, value);
            for stage in ["pretrain", "train"] {
                run.refuses(
                    run.words(stage),
                    &["file-000.parquet", &format!("column {column}, row 11"), "is not a finite number"],
                );
            }
            run.refuses(vec!["inspect".into(), run.name("dataset")], &["row 11"]);
        }
    }
}

/// Puts a number into a data file and mends hash and seal of the dataset, as a faulty writer of ours would.
fn forge(root: &Path, column: &str, row: usize, value: f32) {
    let name = "data/chunk-000/file-000.parquet";
    let old = blake3::hash(&fs::read(root.join(name)).expect("data")).to_hex();
    let reader = ParquetRecordBatchReaderBuilder::try_new(fs::File::open(root.join(name)).expect("data")).expect("parquet");
    let batches: Vec<RecordBatch> = reader.build().expect("reader").map(|b| b.expect("batch")).collect();
    let mut writer = ArrowWriter::try_new(Vec::new(), batches[0].schema(), None).expect("writer");
    let mut first = 0;
    for batch in &batches {
        let mut columns = batch.columns().to_vec();
        if (first..first + batch.num_rows()).contains(&row) {
            let at = batch.schema().index_of(column).expect("column");
            let list = columns[at].as_fixed_size_list();
            let (width, mut values) = (list.value_length(), list.values().as_primitive::<Float32Type>().values().to_vec());
            values[(row - first) * width as usize] = value;
            let arrow_schema::DataType::FixedSizeList(field, _) = list.data_type() else { panic!("a list") };
            let values = Arc::new(Float32Array::from(values));
            columns[at] = Arc::new(FixedSizeListArray::new(Arc::clone(field), width, values, None)) as ArrayRef;
        }
        writer.write(&RecordBatch::try_new(batch.schema(), columns).expect("batch")).expect("written");
        first += batch.num_rows();
    }
    let bytes = writer.into_inner().expect("a file");
    let info = fs::read_to_string(root.join("meta/info.json")).expect("info");
    let info = info.replace(old.as_str(), blake3::hash(&bytes).to_hex().as_str());
    let mark = seal::blank().replace('0', "");
    let digits = info.rfind(&mark).expect("a seal") + mark.len();
    let blank = format!("{}{}{}", &info[..digits], "0".repeat(64), &info[digits + 64..]);
    fs::write(root.join("meta/info.json"), seal::close(blank.into_bytes())).expect("written");
    fs::write(root.join(name), bytes).expect("written");
}

#[test]
fn networks_of_another_size_are_refused() {
    let small = Run::finished();
    let stack = Run::new("stack", 0).all(&[]);
    for (file, kind, stage) in [("policy.safetensors", "policy", "evaluate"), ("dynamics.safetensors", "dynamics", "train")] {
        let (tensors, meta, _) = weights::read(&stack.at(file), kind).expect("weights");
        let (own, own_meta, origin) = weights::read(&small.at(file), kind).expect("weights");
        let path = small.at(file);
        // The tensors of stack under the description of pick-up, and the other way round.
        weights::write(&path, kind, &tensors, &own_meta, &origin).expect("written");
        small.refuses(small.words(stage), &[file, "shape [32]", "[25]"]);
        let mut wrong = meta.clone();
        wrong["task"] = "pick-up".into();
        weights::write(&path, kind, &tensors, &wrong, &origin).expect("written");
        small.refuses(small.words(stage), &[file, "32", "25"]);
        weights::write(&path, kind, &own[1..], &own_meta, &origin).expect("written");
        small.refuses(small.words(stage), &[file, "is missing"]);
        weights::write(&path, kind, &own, &own_meta, &origin).expect("written");
    }
}

#[test]
fn a_failed_episode_is_left_out_with_its_class_in_words() {
    let run = Run::finished();
    let path = run.at("recordings/episode-00001.mcap");
    let (mut episode, origin) = recording::read(&path).expect("a recording");
    for class in FailureClass::ALL {
        (episode.success, episode.failure) = (false, Some(class));
        recording::write(&path, &episode, &origin).expect("written");
        assert_eq!(recording::read(&path).expect("read again").0.failure, Some(class));
        let output = hilt(run.words("convert"));
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{stderr}");
        let said = format!("left out 1 of 4 episodes:\n  episode 1 failed, {}: {}", class.name(), class.words());
        assert!(stderr.contains(&said), "{said}: {stderr}");
    }
}
