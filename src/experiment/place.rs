//! Where the files of a step stand. `TASK/seed-N/PRESET/` holds what no variation changes, `.../VARIATION/` what one does; a policy and its
//! evaluation stand in a directory of their method in there.

use super::step::Output;
use crate::config::Stage;
use crate::data::origin::Kind;
use crate::data::weights;
use std::path::{Path, PathBuf};

/// Recordings of an evaluation.
pub const ROLLOUTS: &str = "rollouts";

/// The name of a stage's artefact, and its kind.
pub fn artefact_of(stage: Stage) -> (&'static str, Kind) {
    match stage {
        Stage::Plan => ("plans.parquet", Kind::Table),
        Stage::Simulate => ("recordings", Kind::Recordings),
        Stage::Convert => ("dataset", Kind::Datasets),
        Stage::Pretrain => ("dynamics.safetensors", Kind::Weights(weights::DYNAMICS)),
        Stage::Train => ("policy.safetensors", Kind::Weights(weights::POLICY)),
        Stage::Evaluate => ("evaluation.json", Kind::Summary),
    }
}

/// What a stage writes into `dir`, the artefact first.
pub fn outputs_of(stage: Stage, dir: &Path, record: bool) -> Vec<Output> {
    let (name, kind) = artefact_of(stage);
    let beside: &[&str] = match stage {
        Stage::Plan | Stage::Simulate | Stage::Convert => &[],
        Stage::Pretrain => &["dynamics.errors.parquet", "dynamics.pretraining.parquet"],
        Stage::Train => &["policy.training.parquet"],
        Stage::Evaluate => &["evaluation.episodes.parquet"],
    };
    let mut outputs = vec![Output { path: dir.join(name), kind }];
    outputs.extend(beside.iter().map(|name| Output { path: dir.join(name), kind: Kind::Table }));
    if record && stage == Stage::Evaluate {
        outputs.push(Output { path: dir.join(ROLLOUTS), kind: Kind::Recordings });
    }
    outputs
}

/// The checkpoint of a training whose policy is to stand at `policy`.
pub fn checkpoint_of(policy: &Path) -> PathBuf {
    policy.with_extension("checkpoint.safetensors")
}
