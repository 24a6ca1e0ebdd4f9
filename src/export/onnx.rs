//! A policy as ONNX: from the raw state row to the mean action in the layout's units, all of it inside the graph.

use super::features;
use crate::data::onnx::{self, Graph, Op, Port, Value};
use crate::data::{ContentHash, Provenance};
use crate::learn::Policy;
use crate::nn::{Activation, Mlp};
use serde_json::{Value as Json, json};

/// The graph's input.
const STATE: &str = "state";
/// The graph's output.
const ACTION: &str = "action";

/// The bytes of a policy's ONNX file. `made` is what made the policy, `content` the hash of the file that it was read from.
pub fn encode(policy: &Policy, made: &Provenance, content: &ContentHash) -> Vec<u8> {
    let layout = policy.layout();
    let doc = format!(
        "A policy of hilt for task {}: the mean action for each state. Kinematics, features and normalisation are part of the graph. The \
         metadata name the entries of a state and of an action; every {} s the state is to be read and the action given to the joints \
         as velocities, none larger than action_limits.",
        layout.name, layout.period_s
    );
    onnx::encode(graph(policy), &doc, metadata(policy, made, content), made)
}

/// What a program has to know that runs it, and where it comes from.
fn metadata(policy: &Policy, made: &Provenance, content: &ContentHash) -> Vec<(String, String)> {
    let layout = policy.layout();
    let settings = ContentHash::of(made.settings.to_string().as_bytes());
    let json = |key: &str, value: Json| (key.to_string(), value.to_string());
    let word = |key: &str, value: String| (key.to_string(), value);
    vec![
        word("task", layout.name.clone()),
        json("state_entries", json!(layout.state_entries().collect::<Vec<_>>())),
        json("action_entries", json!(layout.action_entries().collect::<Vec<_>>())),
        json("action_limits", json!(layout.action_limits)),
        json("period_s", json!(layout.period_s)),
        json("horizon_steps", json!(policy.horizon_steps())),
        json("network_inputs", json!(policy.features().names())),
        word("hilt_version", made.hilt_version.clone()),
        json("seed", json!(made.seed)),
        word("settings_blake3", settings.to_string()),
        word("policy_blake3", content.to_string()),
    ]
}

fn graph(policy: &Policy) -> Graph {
    let (layout, scaling) = (policy.layout(), policy.action_scaling());
    let mut graph = Graph::new(&format!("{} policy", layout.name));
    let listed = |names: Vec<&String>| names.iter().map(|name| name.as_str()).collect::<Vec<_>>().join(", ");
    let said = "SI units, as the names end; quaternions are x y z w";
    let state = graph.input(Port {
        name: STATE.into(),
        width: layout.state_dim(),
        doc: format!("[batch, {}], {said}: {}", layout.state_dim(), listed(layout.state_entries().collect())),
    });
    let inputs = features::inputs(&mut graph, policy.features(), &state);
    let output = network(&mut graph, policy.network(), inputs);
    let mean = graph.constant("action.mean", &[scaling.width()], &scaling.mean);
    let std = graph.constant("action.std", &[scaling.width()], &scaling.std);
    let deviation = graph.apply(Op::Mul, &[&output, &std], "action.deviation");
    let name = graph.apply(Op::Add, &[&mean, &deviation], ACTION);
    let doc = format!("[batch, {}], {said}: {}", layout.action_dim(), listed(layout.action_entries().collect()));
    graph.output(Port { name, width: layout.action_dim(), doc });
    graph
}

/// Layer after layer; the last is linear.
fn network(graph: &mut Graph, net: &Mlp, inputs: Value) -> Value {
    let activation = match net.activation() {
        Activation::Tanh => Op::Tanh,
        Activation::Relu => Op::Relu,
    };
    let mut value = inputs;
    for layer in 0..net.layers() {
        let name = format!("layer_{}", layer + 1);
        let (weights, biases) = net.layer_ranges(layer);
        let shape = [net.widths()[layer], net.widths()[layer + 1]];
        let weight = graph.constant(&format!("{name}.weight"), &shape, &net.params()[weights]);
        let bias = graph.constant(&format!("{name}.bias"), &shape[1..], &net.params()[biases]);
        value = graph.apply(Op::Gemm, &[&value, &weight, &bias], &name);
        if layer + 1 < net.layers() {
            value = graph.apply(activation, &[&value], &format!("{name}.activated"));
        }
    }
    value
}
