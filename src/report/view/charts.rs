//! Numbers along an episode: distances, forces, joint velocities, how far the dynamics network was off.

use super::ghost::Ghost;
use super::pack::f32s;
use crate::demo::{Episode, Step};
use crate::robot::model::JointKind;
use nalgebra::Vector3;
use serde_json::{Value, json};

/// A chart of one or more lines.
struct Chart {
    title: &'static str,
    unit: &'static str,
    /// Digits behind the point.
    digits: usize,
    /// Whether the same line of another episode says something beside it.
    compare: bool,
    lines: Vec<(String, Vec<f64>)>,
}

impl Chart {
    fn content(self) -> Value {
        let Chart { title, unit, digits, compare, lines } = self;
        let names: Vec<&str> = lines.iter().map(|(name, _)| name.as_str()).collect();
        let values = f32s(lines.iter().flat_map(|(_, values)| values.iter().copied()));
        json!({ "title": title, "unit": unit, "digits": digits, "compare": compare, "lines": names, "values": values })
    }
}

/// All charts that have a line.
pub(super) fn all(episode: &Episode, ghost: Option<&Ghost>) -> Vec<Value> {
    let robot = &episode.scene.robot;
    let of_kind = |kind: JointKind| {
        let joints = robot.joints.iter().enumerate().filter(move |(_, joint)| joint.kind == kind);
        joints.map(|(i, joint)| (joint.name.clone(), along(episode, |step| step.state.dq[i]))).collect::<Vec<_>>()
    };
    let (turning, sliding) = (of_kind(JointKind::Revolute), of_kind(JointKind::Prismatic));
    let charts = [
        Chart { title: "Distances", unit: "m", digits: 3, compare: true, lines: distances(episode) },
        Chart {
            title: "Dynamics network off by",
            unit: "mm",
            digits: 1,
            compare: true,
            lines: ghost.map_or_else(Vec::new, |ghost| off_mm(episode, ghost)),
        },
        Chart { title: "Force of the fingers", unit: "N", digits: 1, compare: true, lines: forces(episode) },
        Chart { title: "Joint velocities", unit: "rad/s", digits: 2, compare: false, lines: turning },
        Chart { title: "Sliding joints", unit: "m/s", digits: 3, compare: false, lines: sliding },
    ];
    charts.into_iter().filter(|chart| !chart.lines.is_empty()).map(Chart::content).collect()
}

fn along(episode: &Episode, of: impl Fn(&Step) -> f64) -> Vec<f64> {
    episode.moments().map(of).collect()
}

/// Of each object that a goal moves: from the hand, and from where it is to be \[m\].
fn distances(episode: &Episode) -> Vec<(String, Vec<f64>)> {
    let (scene, task) = (&episode.scene, &episode.scene.task);
    let place = |step: &Step, object: usize| Vector3::from(step.objects[object].pose.position_m);
    let of_goal = |goal: usize| {
        let (object, target) = (task.goals[goal].object, Vector3::from(scene.target_m(goal)));
        let hand = |step: &Step| scene.robot.tool_pose(&step.state.q).translation.vector;
        let name = &task.objects[object].name;
        [
            (format!("hand to {name}"), along(episode, |step| (hand(step) - place(step, object)).norm())),
            (format!("{name} to goal"), along(episode, |step| (place(step, object) - target).norm())),
        ]
    };
    (0..task.goals.len()).flat_map(of_goal).collect()
}

/// Of each object that is ever touched: the sum over the fingers \[N\].
fn forces(episode: &Episode) -> Vec<(String, Vec<f64>)> {
    let of = |(i, name): (usize, String)| (name, along(episode, |step| step.contacts.objects[i].fingers_n.iter().sum()));
    let names = episode.scene.task.objects.iter().map(|object| object.name.clone());
    names.enumerate().map(of).filter(|(_, forces)| forces.iter().any(|force| *force > 0.0)).collect()
}

/// Between where the dynamics network expected tool and moved objects, and where they are \[mm\].
fn off_mm(episode: &Episode, ghost: &Ghost) -> Vec<(String, Vec<f64>)> {
    const MM: f64 = 1000.0;
    let (robot, task) = (&episode.scene.robot, &episode.scene.task);
    let joints = robot.joints.len();
    let both = |of: &dyn Fn(&Step, &[f64]) -> f64| episode.moments().zip(&ghost.rows).map(|(step, row)| of(step, row)).collect();
    let tool = |q: &[f64]| robot.tool_pose(q).translation.vector;
    let hand = ("hand".to_string(), both(&|step, row| MM * (tool(&step.state.q) - tool(&row[..joints])).norm()));
    let of_object = |i: usize| {
        let off = both(&|step, row| {
            let expected = Vector3::from_column_slice(&row[joints + 7 * i..][..3]);
            MM * (expected - Vector3::from(step.objects[i].pose.position_m)).norm()
        });
        (task.objects[i].name.clone(), off)
    };
    [hand].into_iter().chain((0..task.moved()).map(of_object)).collect()
}
