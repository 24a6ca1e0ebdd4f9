//! The whole artefacts that inputs are made of: the fixtures, cut to a few steps, and tiny networks.

use hilt::config::{PretrainSettings, TrainSettings};
use hilt::data::dataset::{self, DatasetEpisode};
use hilt::data::{Provenance, recording, table_file, weights};
use hilt::demo::Demo;
use hilt::interrupt::Interrupt;
use hilt::learn::{Checkpoint, Dynamics, Hooks, Inputs, MethodName, pretrain_dynamics, train};
use hilt::plan::{Plan, from_table, to_table};
use hilt::robot::file::built_in::paper_robot;
use hilt::task::built_in::pick_up;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Steps that are left of a motion.
const STEPS: usize = 5;

/// A file of the fixtures.
pub fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/pick-up").join(name)
}

/// A file of the robot that nobody has; its mesh stands beside it.
pub fn robot(name: &str) -> Vec<u8> {
    std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/robots").join(name)).expect("a fixture")
}

fn provenance(stage: &str) -> Provenance {
    Provenance::new(stage, "pick-up", json!({ "plan": { "speed": 1.0 } }), 3)
}

/// A short recording.
pub fn recording() -> Vec<u8> {
    let (mut episode, made) = recording::read(&fixture("recordings/episode-00000.mcap")).expect("a fixture");
    episode.steps.truncate(STEPS);
    recording::encode(Path::new("episode"), &episode, &made).expect("an episode")
}

/// Plans of a few waypoints each.
pub fn plans() -> Vec<Plan> {
    let (table, _) = table_file::read(&fixture("plans.parquet")).expect("a fixture");
    let mut plans = from_table(&paper_robot(), &pick_up(), &table).expect("plans");
    plans.iter_mut().for_each(|plan| plan.waypoints.truncate(STEPS));
    plans
}

/// The table of [`plans`] as a file.
pub fn table(table: &hilt::table::Table) -> Option<Vec<u8>> {
    table_file::encode(Path::new("plans"), table, &provenance("plan")).ok()
}

/// The table of [`plans`].
pub fn plan_table() -> hilt::table::Table {
    to_table(&paper_robot(), &plans())
}

/// A demo of a few steps.
pub fn demo() -> Demo {
    let found = dataset::read(&fixture("dataset/validation")).expect("a fixture");
    let (demo, dim) = (&found.demos[0], found.layout.state_dim());
    let cut = |rows: &[f32], width: usize, count: usize| rows[..width * count].to_vec();
    let (actions, executed) =
        (cut(demo.actions(), found.layout.action_dim(), STEPS), cut(demo.executed(), found.layout.action_dim(), STEPS));
    Demo::new(demo.layout(), cut(demo.states(), dim, STEPS + 1), actions, executed).expect("a demo")
}

/// Writes a dataset of two short episodes.
pub fn dataset(root: &Path) {
    let demo = demo();
    let of = |source_index| DatasetEpisode { source_index, demo: demo.clone(), rewards: vec![0.5; STEPS], success: true };
    dataset::write(root, (&paper_robot(), &pick_up()), &[of(0), of(1)].as_slice().into(), &provenance("convert"))
        .expect("a dataset");
}

/// A dynamics network of a few units.
pub fn dynamics() -> Dynamics {
    let settings = PretrainSettings { hidden_units: 4, hidden_layers: 1, epochs: 1, ..Default::default() };
    let demos = [demo()];
    pretrain_dynamics(&demos, &demos, &settings, 0, &mut |_, _| {}, &Interrupt::default()).expect("pretrains").0
}

/// Settings of a training of a moment.
pub fn settings() -> TrainSettings {
    TrainSettings {
        hidden_units: 4,
        hidden_layers: 1,
        warm_start_updates: 2.into(),
        bc_batch: 8,
        epochs: 2,
        min_updates: 0,
        select_episodes: 3,
        ..Default::default()
    }
}

/// Goes on after a checkpoint, or begins; the checkpoints on the way.
pub fn training(dynamics: &Dynamics, resume: Option<Checkpoint>, interrupt: &Interrupt) -> hilt::error::Result<Vec<Checkpoint>> {
    let (demos, mut kept) = ([demo()], Vec::new());
    let keep = Box::new(|checkpoint: &Checkpoint| kept.push(checkpoint.clone()));
    let keep_every = Some(Duration::ZERO);
    let hooks = Hooks { keep, keep_every, resume, score: Box::new(|_| Ok(1)), ..Hooks::new(interrupt) };
    train(MethodName::Hil, Inputs::new(&demos, &demos)?, Some(dynamics.clone()), &settings(), 0, hooks)?;
    Ok(kept)
}

/// Weights as a file.
pub fn weights(kind: &str, tensors: &[hilt::tensor::NamedTensor], meta: &serde_json::Value) -> Option<Vec<u8>> {
    weights::encode(Path::new("weights"), kind, tensors, meta, &provenance("train")).ok()
}
