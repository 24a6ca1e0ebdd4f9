//! Artefacts for `tests/interop/run.sh`, of every format that other programs read.

use crate::fixtures::{episode, provenance, table, tensors};
use hilt::data::dataset::{self, DatasetEpisode};
use hilt::data::{json_file, recording, table_file, weights};
use hilt::interrupt::Interrupt;
use hilt::robot::file::built_in::paper_robot;
use hilt::task::built_in::of_the_paper;
use serde_json::json;
use std::path::PathBuf;

/// `HILT_INTEROP_DIR=DIR cargo test --test files -- --ignored write_a_run` leaves a small made-up run in DIR/TASK for each task.
#[test]
#[ignore = "writes files for other programs"]
fn write_a_run() {
    let runs = PathBuf::from(std::env::var_os("HILT_INTEROP_DIR").expect("HILT_INTEROP_DIR names a directory"));
    for task in of_the_paper() {
        let dir = runs.join(&task.name);
        let origin = |stage| provenance(stage, &task);
        let episodes: Vec<_> = (0..12).map(|i| episode(&task, i, 20 + i as usize)).collect();
        for e in &episodes {
            let path = dir.join("recordings").join(recording::file_name(e.index));
            recording::write(&path, e, &origin("simulate")).expect("written");
        }
        let demos: Vec<_> = episodes.iter().map(|e| e.to_demo().expect("a demo")).collect();
        let (train, validation) = dataset::split(episodes.len(), 10, 0);
        let pick = |of: &[usize]| of.iter().map(|i| DatasetEpisode::of(&episodes[*i], demos[*i].clone())).collect::<Vec<_>>();
        let (train, validation) = (pick(&train), pick(&validation));
        dataset::write_split(
            &dir.join("dataset"),
            (&paper_robot(), &task),
            &train.as_slice().into(),
            &validation.as_slice().into(),
            &origin("convert"),
            &Interrupt::default(),
        )
        .expect("written");
        for kind in ["dynamics", "policy"] {
            weights::write(&dir.join(format!("{kind}.safetensors")), kind, &tensors(), &json!({}), &origin("train"))
                .expect("written");
        }
        for name in ["plans.parquet", "policy.training.parquet", "evaluation.episodes.parquet"] {
            table_file::write(&dir.join(name), &table(100), &origin("plan")).expect("written");
        }
        json_file::write(&dir.join("evaluation.json"), &json!({ "task": task.name, "episodes": 0 }), &origin("evaluate"))
            .expect("written");
    }
}
