//! Exported policies: a graph of ONNX's operators says what the policy itself says, and what is no policy is refused.

mod command;
mod interpreter;

use hilt::config::{ChosenTask, FeatureSet, TrainSettings};
use hilt::data::{ContentHash, Provenance};
use hilt::demo::Demo;
use hilt::export;
use hilt::layout::Layout;
use hilt::learn::Policy;
use hilt::learn::models::Corpus;
use hilt::nn::Activation;
use hilt::robot::Robot;
use hilt::robot::file::{self, built_in};
use hilt::seed::stream;
use hilt::task;
use interpreter::Tensor;
use rand::{Rng, RngExt};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// Largest difference of an action [rad/s, m/s].
const TOLERANCE: f32 = 1e-5;
/// States of which each policy's scalings are made, and on which it is tried.
const STATES: usize = 120;

/// Random joint positions and velocities, with bodies near the hand and far from it in turn.
fn states(layout: &Layout, robot: &Robot, rng: &mut impl Rng) -> Vec<Vec<f32>> {
    let one = |i: usize| {
        let mut state: Vec<f32> = (0..layout.state_dim()).map(|_| 2.0 * rng.random::<f32>() - 1.0).collect();
        let q: Vec<f64> = state[layout.positions()].iter().map(|v| f64::from(*v)).collect();
        let tool = robot.tool_pose(&q).translation.vector;
        let reach_m = if i.is_multiple_of(2) { 0.02 } else { 0.3 };
        let bodies = layout.state_spans().filter(|(span, _)| span.entries[0].ends_with(".x_m"));
        for (_, at) in bodies {
            (0..3).for_each(|k| state[at.start + k] = tool[k] as f32 + reach_m * state[at.start + k]);
        }
        state
    };
    (0..STATES).map(one).collect()
}

/// A policy of random weights whose scalings are those of these states.
fn policy(layout: &Arc<Layout>, states: &[Vec<f32>], settings: &TrainSettings) -> Policy {
    let mut rng = stream(0, "test", 0);
    let actions: Vec<f32> = (0..(states.len() - 1) * layout.action_dim()).map(|_| 2.0 * rng.random::<f32>() - 1.0).collect();
    let demo = Demo::new(layout, states.concat(), actions.clone(), actions).expect("lengths fit");
    Policy::new(&Corpus::new(&[demo], "training").expect("a demo"), settings, &mut rng)
}

fn made(task: &str) -> Provenance {
    Provenance::new("train", task, json!({ "train": { "rho": 0.5 } }), 7)
}

fn exported(policy: &Policy) -> Vec<u8> {
    export::onnx::encode(policy, &made(&policy.layout().name.to_lowercase()), &ContentHash::of(b"weights"))
}

fn agrees(policy: &Policy, states: &[Vec<f32>]) {
    let model = interpreter::model(&exported(policy));
    let graph = model.graph.as_ref().expect("a graph");
    assert_eq!(interpreter::port(&graph.input).1, policy.layout().state_dim());
    let batch = Tensor { shape: vec![states.len(), states[0].len()], data: states.concat() };
    let found = interpreter::run(&model, batch);
    assert_eq!(found.shape, [states.len(), policy.layout().action_dim()]);
    let (wanted, name) = (states.iter().flat_map(|state| policy.act(state)), &policy.layout().name);
    let worst = found.data.iter().zip(wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(worst <= TOLERANCE, "{name} {:?}: {worst}", policy.settings());
    let first = interpreter::run(&model, Tensor { shape: vec![1, states[0].len()], data: states[0].clone() });
    assert_eq!(first.data, found.data[..policy.layout().action_dim()], "a row by itself");
}

fn fixture(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name).display().to_string()
}

#[test]
fn every_task_robot_and_network_acts_as_in_hilt() {
    let five = file::read(Path::new(&fixture("robots/five.toml"))).expect("a robot").robot;
    assert_eq!(five.arm, 5);
    let robots: Vec<Arc<Robot>> = built_in::all().chain([Arc::new(five)]).collect();
    let coffee = ChosenTask::read(&fixture("tasks/coffee.toml")).expect("a task");
    let tasks: Vec<Arc<task::Task>> = task::built_in::all().into_iter().chain([Arc::clone(&coffee)]).collect();
    let sets = [FeatureSet::Raw, FeatureSet::Fk, FeatureSet::FkNear];
    let kinds = [(Activation::Tanh, false), (Activation::Relu, true), (Activation::Tanh, true), (Activation::Relu, false)];
    let (mut tried, mut rng) = (0, stream(1, "test", 0));
    for robot in &robots {
        for task in &tasks {
            let layout = task.layout(robot);
            let states = states(&layout, robot, &mut rng);
            for features in sets {
                let (activation, mask_dq) = kinds[tried % kinds.len()];
                let settings = TrainSettings {
                    features,
                    activation,
                    mask_dq,
                    hidden_units: 24,
                    hidden_layers: 1 + tried % 3,
                    ..Default::default()
                };
                agrees(&policy(&layout, &states, &settings), &states);
                tried += 1;
            }
        }
    }
    assert_eq!(tried, 4 * 7 * 3);
}

/// What the fixed transforms of the first joint leave: nothing that depends on the state but its own angle.
#[test]
fn an_arm_of_one_joint_is_exported() {
    let robot = built_in::paper_robot();
    let mut layout = (*task::built_in::stack().layout(&robot)).clone();
    layout.arm.as_mut().expect("an arm").joints.truncate(1);
    let (arm, fingers) = layout.action.split_at_mut(1);
    let rest = arm[0].entries.split_off(1);
    fingers[0].entries.splice(0..0, rest);
    layout.check().expect("a layout");
    let states = states(&layout, &robot, &mut stream(2, "test", 0));
    agrees(&policy(&Arc::new(layout), &states, &TrainSettings::default()), &states);
}

#[test]
fn the_file_says_what_it_takes_gives_and_comes_from() {
    let (robot, task) = (built_in::paper_robot(), task::built_in::stack());
    let layout = task.layout(&robot);
    let policy = policy(&layout, &states(&layout, &robot, &mut stream(3, "test", 0)), &TrainSettings::default());
    let bytes = exported(&policy);
    assert_eq!(bytes, exported(&policy), "the same bytes");
    let model = interpreter::model(&bytes);
    assert_eq!((model.producer_name(), model.opset_import[0].version(), model.opset_import.len()), ("hilt", 13, 1));
    let graph = model.graph.as_ref().expect("a graph");
    let (state, action) = (interpreter::port(&graph.input), interpreter::port(&graph.output));
    assert_eq!((state.0, state.1, action.0, action.1), ("state", 32, "action", 9));
    assert!(state.2.contains("joint_1.q_rad") && state.2.contains("base.qw") && action.2.contains("finger_3.velocity_rad_s"));
    let said: BTreeMap<&str, &str> = model.metadata_props.iter().map(|p| (p.key(), p.value())).collect();
    let listed = |key: &str| serde_json::from_str::<Value>(said[key]).expect("JSON");
    assert_eq!(listed("state_entries"), json!(layout.state_entries().collect::<Vec<_>>()));
    assert_eq!(listed("action_entries"), json!(layout.action_entries().collect::<Vec<_>>()));
    assert_eq!(listed("network_inputs"), policy.meta()["inputs"]);
    assert_eq!((listed("period_s"), listed("seed")), (json!(0.05), json!(7)));
    assert_eq!(said["hilt"], made("stack").to_json());
    assert_eq!(said["policy_blake3"], ContentHash::of(b"weights").to_string());
    assert_eq!(said["settings_blake3"], ContentHash::of(br#"{"train":{"rho":0.5}}"#).to_string());
    hilt::data::seal::check(Path::new("policy.onnx"), &bytes).expect("a whole seal");
}
