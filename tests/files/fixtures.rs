//! Made-up episodes, tables and weights with awkward numbers: what files must keep exactly.

use hilt::data::Provenance;
use hilt::demo::{Body, Contacts, Episode, Phase, Step, Touch};
use hilt::joints::Joints;
use hilt::robot::file::built_in::paper_robot;
use hilt::scene::{Obstacle, Placed, Scene};
use hilt::seed::stream;
use hilt::state::{Pose, State};
use hilt::table::{Table, Values};
use hilt::tasks::{FailureClass, Task};
use hilt::tensor::NamedTensor;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde_json::json;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A file's bytes, or those of all files below a directory.
pub fn contents(path: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    if path.is_file() {
        return BTreeMap::from([(PathBuf::new(), fs::read(path).expect("readable"))]);
    }
    let inner = |entry: fs::DirEntry| {
        let name = PathBuf::from(entry.file_name());
        contents(&entry.path()).into_iter().map(move |(below, bytes)| (name.join(below), bytes))
    };
    fs::read_dir(path).expect("readable").flat_map(|entry| inner(entry.expect("entry"))).collect()
}

/// A provenance with nested settings.
pub fn provenance(stage: &str, task: &Task) -> Provenance {
    let mut made = Provenance::new(stage, &task.name, json!({ "noise_variance": 0.001, "pulses": { "steps": 4 } }), 7);
    made.inputs.insert("plans.parquet".into(), "ab".repeat(32));
    made
}

/// An episode of `steps` steps, the same for the same arguments.
pub fn episode(task: &Arc<Task>, index: u64, steps: usize) -> Episode {
    let mut rng = stream(index, "files test", steps as u64);
    let placed = |_| Placed { pose: pose(&mut rng), friction: 1.0, mass_kg: 0.1 };
    let scene = Scene {
        robot: paper_robot(),
        task: Arc::clone(task),
        objects: task.objects.iter().map(placed).collect(),
        goals: vec![[0.5, -0.1, 0.025]; task.goal_names().len()],
        obstacles: vec![Obstacle { center_m: [0.4, 0.1, 0.1], size_m: [0.02, 0.3, 0.2] }; index as usize % 2],
        finger_friction: if index % 3 == 2 { 0.4 } else { 1.0 },
    };
    let steps: Vec<Step> = (0..steps).map(|t| step(&scene, t, &mut rng)).collect();
    let mut last = step(&scene, 0, &mut rng);
    last.commanded = Joints::zeros(9);
    last.executed = Joints::zeros(9);
    last.phase = None;
    let success = index % 3 != 2;
    Episode { index, scene, steps, last, success, failure: (!success).then_some(FailureClass::Dropped) }
}

fn step(scene: &Scene, t: usize, rng: &mut ChaCha8Rng) -> Step {
    let objects = scene.objects.len();
    let now: Vec<Body> = (0..objects).map(|_| Body { pose: pose(rng), speed_m_s: rng.random() }).collect();
    let mut state = State { q: numbers(rng), dq: numbers(rng), ..scene.start() };
    let moved = scene.task.moved();
    state.objects.iter_mut().zip(&now).take(moved).for_each(|(seen, now)| *seen = now.pose);
    let mut commanded = numbers(rng);
    commanded[3] = -0.0;
    // Each object touches the one before it.
    let mut touch = |i: usize| Touch {
        fingers_n: [rng.random(), 0.0, f64::MIN_POSITIVE].into(),
        table: rng.random(),
        objects: i.checked_sub(1).into_iter().collect(),
    };
    let touches = (0..objects).map(&mut touch).collect();
    Step {
        state,
        objects: now,
        commanded,
        executed: numbers(rng),
        contacts: Contacts { objects: touches, robot_obstacle: rng.random(), robot_table: rng.random() },
        reward: if t == 3 { 0.1 } else { 0.0 },
        conditions: scene.task.condition_names().iter().map(|_| rng.random()).collect(),
        phase: Some(Phase::ALL[t % Phase::ALL.len()]),
    }
}

fn numbers(rng: &mut ChaCha8Rng) -> Joints {
    Joints::from_fn(9, |_| rng.random_range(-3.0..3.0))
}

fn pose(rng: &mut ChaCha8Rng) -> Pose {
    Pose::from_yaw([rng.random_range(0.3..0.6), rng.random_range(-0.2..0.2), 0.025], rng.random_range(-3.0..3.0))
}

/// A table with a column of each type, a NaN and awkward text.
pub fn table(rows: usize) -> Table {
    let mut rng = stream(1, "files test table", rows as u64);
    let mut doubles: Vec<f64> = (0..rows).map(|_| rng.random_range(-1e9..1e9)).collect();
    if let Some(first) = doubles.first_mut() {
        *first = f64::NAN;
    }
    Table::default()
        .with("loss", "mean over the epoch", Values::F32((0..rows).map(|_| rng.random()).collect()))
        .with("speed_m_s", "speed of the block", Values::F64(doubles))
        .with("episode", "number of the episode", Values::I64((0..rows as i64).collect()))
        .with("solved", "whether it was solved", Values::Bool((0..rows).map(|_| rng.random()).collect()))
        .with("failure", "why not", Values::Text((0..rows).map(|i| format!("\"é\n{}", i % 3)).collect()))
}

/// Tensors in an order that is not alphabetical.
pub fn tensors() -> Vec<NamedTensor> {
    let mut rng = stream(2, "files test tensors", 0);
    let mut make = |name: &str, shape: &[usize]| NamedTensor {
        name: name.into(),
        shape: shape.to_vec(),
        data: (0..shape.iter().product()).map(|_| rng.random_range(-1.0..1.0)).collect(),
    };
    vec![make("policy.layer_2.weight", &[9, 32]), make("policy.layer_1.weight", &[32, 25]), make("policy.layer_1.bias", &[32])]
}
