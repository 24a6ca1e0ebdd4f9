//! Which fingers close on each other, and how strongly.

use super::collision::Solid;
use super::model::Robot;
use nalgebra::{Isometry3, Vector3};

/// Two fingers oppose each other when the cosine of the angle between their ways is below this: they come from different sides.
pub const AGAINST: f64 = -0.1;

/// Small movement of a finger, to see how far its pad goes \[rad, m\].
const NUDGE: f64 = 1e-6;

/// Two fingers that close on each other.
pub struct Opposing {
    /// Counted from the first finger.
    pub pair: [usize; 2],
    /// Cosine of the angle between their ways: -1 when they come straight at each other.
    pub cosine: f64,
    /// Room between the middles of their pads in the open hand \[m\].
    pub room_m: f64,
}

/// All pairs that do, by what their pads do when the hand closes.
pub fn opposing(robot: &Robot) -> Vec<Opposing> {
    let mut closed = robot.ready;
    closed[robot.arm..].copy_from_slice(&robot.closed);
    let (open, shut) = (pads(robot, &robot.ready), pads(robot, &closed));
    let ways: Vec<Vector3<f64>> = open.iter().zip(&shut).map(|(open, shut)| shut - open).collect();
    let pairs = (0..ways.len()).flat_map(|a| (a + 1..ways.len()).map(move |b| [a, b]));
    let found = pairs.map(|[a, b]| Opposing {
        pair: [a, b],
        cosine: ways[a].xy().dot(&ways[b].xy()) / (ways[a].norm() * ways[b].norm()).max(f64::MIN_POSITIVE),
        room_m: (open[a] - open[b]).xy().norm(),
    });
    found.filter(|opposing| opposing.cosine < AGAINST).collect()
}

/// Force with which each finger can press at its pad in the open hand \[N\].
pub fn press_n(robot: &Robot) -> Vec<f64> {
    let mut nudged = robot.ready;
    nudged[robot.arm..].iter_mut().for_each(|finger| *finger += NUDGE);
    let moved =
        pads(robot, &robot.ready).into_iter().zip(pads(robot, &nudged)).map(|(before, after)| (after - before).norm() / NUDGE);
    moved.zip(robot.fingers()).map(|(lever, joint)| robot.joints[joint].effort / lever.max(f64::MIN_POSITIVE)).collect()
}

/// Where the pad of each finger is in the tool's frame \[m\]: the middle of the shape nearest to the tool.
fn pads(robot: &Robot, q: &[f64]) -> Vec<Vector3<f64>> {
    let poses = robot.link_poses(q);
    let tool = robot.tool_of(&poses);
    let pad = |joint: usize| {
        let of_link = |pose: &Isometry3<f64>| {
            let centers = robot.links[joint + 1].shapes.iter().map(|shape| Solid::of(shape, pose).sphere().0);
            let local = centers.map(|center| tool.inverse_transform_point(&center).coords);
            local.min_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap_or_default()
        };
        of_link(&poses[joint + 1])
    };
    robot.fingers().map(pad).collect()
}
