//! What a network sees of a state, as operators of a graph: the sums of [`crate::learn::models::Features`] in the same order, so that both round alike.

use super::trigonometry::sin_cos;
use crate::data::onnx::{Graph, Op, Value};
use crate::layout::{Chain, Layout};
use crate::learn::models::{Features, NEAR_M, Scaling};

/// Axis of the entries of a row, or of the vectors that stand below each other.
const ENTRIES: i64 = 1;
/// Axis of the parts of a vector.
const PARTS: i64 = 2;

/// Where the hand is; of each row a vector.
struct Hand {
    tool: Value,
    columns: [Value; 3],
}

/// The network's inputs for `state`.
pub fn inputs(graph: &mut Graph, features: &Features, state: &str) -> Value {
    let kept = features.kept();
    let seen = take(graph, state, "seen", &[kept.len()], kept);
    let scaling = features.state_scaling();
    let of_kept = Scaling { mean: pick(&scaling.mean, kept), std: pick(&scaling.std, kept) };
    let mut inputs = vec![standardise(graph, &seen, &of_kept, "seen")];
    if let Some(arm) = features.layout().arm.as_ref().filter(|_| features.needs_hand()) {
        let hand = hand(graph, arm, state);
        let [x, y, _] = &hand.columns;
        let rest = distances(graph, features.layout(), &hand, state);
        let derived: Vec<&str> = [&hand.tool, x, y].into_iter().chain(&rest).map(String::as_str).collect();
        let derived = graph.apply(Op::Concat(ENTRIES), &derived, "derived.vectors");
        let derived = graph.apply(Op::Flatten, &[&derived], "derived");
        inputs.push(standardise(graph, &derived, features.derived_scaling(), "derived"));
        if features.near_width() > 0 {
            inputs.push(near(graph, &rest));
        }
    }
    let inputs: Vec<&str> = inputs.iter().map(String::as_str).collect();
    graph.apply(Op::Concat(ENTRIES), &inputs, "inputs")
}

fn pick(numbers: &[f32], which: &[usize]) -> Vec<f32> {
    which.iter().map(|i| numbers[*i]).collect()
}

/// Entries of every row, in this shape.
fn take(graph: &mut Graph, row: &str, name: &str, shape: &[usize], entries: &[usize]) -> Value {
    let which = graph.indices(&format!("{name}.entries"), shape, entries);
    graph.apply(Op::Gather(ENTRIES), &[row, &which], name)
}

/// (value - mean) / std.
fn standardise(graph: &mut Graph, value: &str, scaling: &Scaling, name: &str) -> Value {
    let mean = graph.constant(&format!("{name}.mean"), &[scaling.width()], &scaling.mean);
    let std = graph.constant(&format!("{name}.std"), &[scaling.width()], &scaling.std);
    let centred = graph.apply(Op::Sub, &[value, &mean], &format!("{name}.centred"));
    graph.apply(Op::Div, &[&centred, &std], &format!("{name}.standardised"))
}

/// Joint i turns about the z axis of its frame, which stands in that of the joint before.
fn hand(graph: &mut Graph, arm: &Chain, state: &str) -> Hand {
    let joints = arm.joints.len();
    let q = take(graph, state, "arm.q", &[joints], &(0..joints).collect::<Vec<_>>());
    let axis = graph.indices("parts", &[1], &[PARTS as usize]);
    let q = graph.apply(Op::Unsqueeze, &[&q, &axis], "arm.q.column");
    let [sin, cos] = sin_cos(graph, &q, "arm.q").map(|value| graph.split(&value, ENTRIES, joints, &value));
    let mut before: Option<([Value; 3], Value)> = None;
    for (i, frame) in arm.joints.iter().enumerate() {
        let name = format!("joint_{}", i + 1);
        let [x, y, z] = frame.columns;
        let vectors = [x, y, z, frame.origin_m].map(|v| v.map(|v| v as f32));
        let [x, y, z, position] = match &before {
            // the first in the world
            None => {
                let names = ["x", "y", "z", "origin"].into_iter().zip(vectors);
                names.map(|(part, v)| graph.constant(&format!("{name}.{part}"), &[1, 1, 3], &v)).collect::<Vec<_>>()
            }
            Some((columns, position)) => {
                let turned = turn(graph, columns, &vectors, &format!("{name}.frame"));
                let mut parts = graph.split(&turned, ENTRIES, vectors.len(), &format!("{name}.frame.parts"));
                parts[3] = graph.apply(Op::Add, &[position, &parts[3]], &format!("{name}.origin"));
                parts
            }
        }
        .try_into()
        .expect("three axes and an origin");
        let columns = turned_about_z(graph, [x, y, z], &sin[i], &cos[i], &name);
        before = Some((columns, position));
    }
    let (columns, position) = before.expect("an arm has a joint");
    let tool = turn(graph, &columns, &[arm.tool_m.map(|v| v as f32)], "hand.tool.from_last_joint");
    let tool = graph.apply(Op::Add, &[&position, &tool], "hand.tool");
    Hand { tool, columns }
}

/// Axes after a turn about the third.
fn turned_about_z(graph: &mut Graph, [x, y, z]: [Value; 3], sin: &str, cos: &str, name: &str) -> [Value; 3] {
    let mut times = |axis: &str, factor: &str, part: &str| graph.apply(Op::Mul, &[axis, factor], &format!("{name}.{part}"));
    let [x_cos, y_sin] = [times(&x, cos, "x_cos"), times(&y, sin, "y_sin")];
    let [y_cos, x_sin] = [times(&y, cos, "y_cos"), times(&x, sin, "x_sin")];
    let x = graph.apply(Op::Add, &[&x_cos, &y_sin], &format!("{name}.x_axis"));
    let y = graph.apply(Op::Sub, &[&y_cos, &x_sin], &format!("{name}.y_axis"));
    [x, y, z]
}

/// R v of each of these vectors, R given by its columns; they come to stand below each other.
fn turn(graph: &mut Graph, columns: &[Value; 3], vectors: &[[f32; 3]], name: &str) -> Value {
    let mut parts = Vec::new();
    for (k, column) in columns.iter().enumerate() {
        let factors: Vec<f32> = vectors.iter().map(|v| v[k]).collect();
        let factors = graph.constant(&format!("{name}.factors_{}", k + 1), &[1, vectors.len(), 1], &factors);
        parts.push(graph.apply(Op::Mul, &[column, &factors], &format!("{name}.part_{}", k + 1)));
    }
    sum(graph, &parts, name)
}

/// (a + b) + c.
fn sum(graph: &mut Graph, parts: &[Value], name: &str) -> Value {
    let two = graph.apply(Op::Add, &[&parts[0], &parts[1]], &format!("{name}.of_two"));
    graph.apply(Op::Add, &[&two, &parts[2]], name)
}

/// What is to become 0: each object in the hand's frame, and for each aim where its object is to go minus where it is.
fn distances(graph: &mut Graph, layout: &Layout, hand: &Hand, state: &str) -> Vec<Value> {
    let mut found = Vec::new();
    let position = |at: usize| [at, at + 1, at + 2];
    let objects: Vec<usize> = layout.objects().flat_map(|(_, at)| position(at)).collect();
    if !objects.is_empty() {
        let at = take(graph, state, "objects", &[objects.len() / 3, 3], &objects);
        let from_tool = graph.apply(Op::Sub, &[&at, &hand.tool], "objects.from_tool");
        let mut along = Vec::new();
        for (column, axis) in hand.columns.iter().zip(["x", "y", "z"]) {
            let name = format!("objects.in_hand.{axis}");
            let product = graph.apply(Op::Mul, &[column, &from_tool], &format!("{name}.product"));
            let parts = graph.split(&product, PARTS, 3, &format!("{name}.parts"));
            along.push(sum(graph, &parts, &name));
        }
        let along: Vec<&str> = along.iter().map(String::as_str).collect();
        found.push(graph.apply(Op::Concat(PARTS), &along, "objects.in_hand"));
    }
    let aims: Vec<_> = layout.aims().collect();
    if !aims.is_empty() {
        let shape = [aims.len(), 3];
        let objects: Vec<usize> = aims.iter().flat_map(|(object, ..)| position(*object)).collect();
        let targets: Vec<usize> = aims.iter().flat_map(|(_, target, _)| position(*target)).collect();
        let offsets: Vec<f32> = aims.iter().flat_map(|(.., offset_m)| offset_m.map(|v| v as f32)).collect();
        let objects = take(graph, state, "aims.objects", &shape, &objects);
        let targets = take(graph, state, "aims.targets", &shape, &targets);
        let offsets = graph.constant("aims.offsets", &[1, shape[0], shape[1]], &offsets);
        let places = graph.apply(Op::Add, &[&targets, &offsets], "aims.places");
        found.push(graph.apply(Op::Sub, &[&places, &objects], "aims.missing"));
    }
    found
}

/// tanh(distance / range).
fn near(graph: &mut Graph, distances: &[Value]) -> Value {
    let distances: Vec<&str> = distances.iter().map(String::as_str).collect();
    let vectors = graph.apply(Op::Concat(ENTRIES), &distances, "near.vectors");
    let row = graph.apply(Op::Flatten, &[&vectors], "near.distances");
    let range = graph.constant("near.range_m", &[1], &[NEAR_M]);
    let ranges = graph.apply(Op::Div, &[&row, &range], "near.ranges");
    graph.apply(Op::Tanh, &[&ranges], "near")
}
