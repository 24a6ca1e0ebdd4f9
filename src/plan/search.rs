//! RRT-Connect and shortcutting for transits that are not free in a straight line. Configurations are joint angles on the set where the hand
//! is level: every step goes to a level pose and takes the arm along by inverse kinematics, so a carried object stays upright.

use super::path::{Knot, tool_pose};
use super::world::{Moved, World};
use crate::interrupt::Interrupt;
use crate::joints::Joints;
use crate::robot::Ik;
use rand::{Rng, RngExt};

/// Length of a step of the trees \[m\].
const STEP_M: f64 = 0.04;
/// Room that the search may use, and as far as the two ends lie: x, y \[m\].
const REACH_XY_M: [[f64; 2]; 2] = [[0.20, 0.70], [-0.45, 0.45]];
/// Greatest height of the tool point in a search \[m\].
const REACH_Z_M: f64 = 0.45;

/// A node of a tree.
#[derive(Clone, Copy)]
struct Node {
    knot: Knot,
    q: Joints,
    parent: usize,
}

/// What a search needs to know.
pub(super) struct Search<'a> {
    pub(super) ik: &'a mut Ik,
    pub(super) world: &'a World<'a>,
    pub(super) moved: &'a Moved,
    /// Distance to keep from everything fixed \[m\].
    pub(super) margin_m: f64,
    pub(super) iterations: usize,
    pub(super) shortcuts: usize,
    pub(super) interrupt: &'a Interrupt,
}

impl Search<'_> {
    /// Knots of a free path between two ends, each with its joint angles; `None` when the iterations are spent, or on an interrupt.
    pub(super) fn connect(&mut self, from: (Knot, Joints), to: (Knot, Joints), rng: &mut impl Rng) -> Option<Vec<Knot>> {
        let mut trees = [from, to].map(|(knot, q)| vec![Node { knot, q, parent: 0 }]);
        let reach = |[low, high]: [f64; 2], a: f64, b: f64| [low.min(a).min(b), high.max(a).max(b)];
        let x = reach(REACH_XY_M[0], from.0.x, to.0.x);
        let y = reach(REACH_XY_M[1], from.0.y, to.0.y);
        let low_z = from.0.z.min(to.0.z);
        let z = [low_z, REACH_Z_M.max(from.0.z).max(to.0.z)];
        for round in 0..self.iterations {
            self.interrupt.check().ok()?;
            let (grown, other) = (round % 2, 1 - round % 2);
            let mut within = |[low, high]: [f64; 2]| low + (high - low) * rng.random::<f64>();
            let goal = Knot::new(within(x), within(y), within(z), within([from.0.w, to.0.w]));
            let start = nearest(&trees[grown], &goal);
            let Some(node) = self.step(&trees[grown], start, &goal) else { continue };
            trees[grown].push(node);
            let mut at = nearest(&trees[other], &node.knot);
            while let Some(next) = self.step(&trees[other], at, &node.knot) {
                trees[other].push(next);
                at = trees[other].len() - 1;
                if (next.knot - node.knot).norm() < f64::EPSILON {
                    let mut path = branch(&trees[0], if grown == 0 { trees[0].len() - 1 } else { at });
                    path.reverse();
                    path.extend(branch(&trees[1], if grown == 1 { trees[1].len() - 1 } else { at }).into_iter().skip(1));
                    return Some(self.shorten(path, rng));
                }
            }
        }
        None
    }

    /// One step from node `at` towards `goal`, if it is free.
    fn step(&mut self, tree: &[Node], at: usize, goal: &Knot) -> Option<Node> {
        let from = tree[at];
        let way = goal - from.knot;
        let knot = if way.norm() <= STEP_M { *goal } else { from.knot + way * (STEP_M / way.norm()) };
        let q = self.ik.solve(&tool_pose(&knot), &from.q).ok()?;
        self.world.check_motion(&from.q, &q, self.moved, self.margin_m).ok()?;
        Some(Node { knot, q, parent: at })
    }

    /// Takes straight shortcuts between random knots, then keeps the corners only.
    fn shorten(&mut self, mut path: Vec<Node>, rng: &mut impl Rng) -> Vec<Knot> {
        for _ in 0..self.shortcuts {
            if path.len() < 3 || self.interrupt.is_raised() {
                break;
            }
            let (a, b) = (rng.random_range(0..path.len()), rng.random_range(0..path.len()));
            let (first, last) = (a.min(b), a.max(b));
            if last - first >= 2
                && let Some(line) = self.line(path[first], path[last].knot)
            {
                path.splice(first + 1..=last, line);
            }
        }
        let corner = |i: usize| {
            let (before, after) = ((path[i].knot - path[i - 1].knot).normalize(), (path[i + 1].knot - path[i].knot).normalize());
            (before - after).norm() > 1e-6
        };
        let inner = (1..path.len() - 1).filter(|i| corner(*i));
        std::iter::once(0).chain(inner).chain([path.len() - 1]).map(|i| path[i].knot).collect()
    }

    /// The nodes of a free straight line, without its first.
    fn line(&mut self, from: Node, to: Knot) -> Option<Vec<Node>> {
        let mut nodes = vec![from];
        while (nodes[nodes.len() - 1].knot - to).norm() > f64::EPSILON {
            let next = self.step(&nodes, nodes.len() - 1, &to)?;
            nodes.push(next);
        }
        nodes.remove(0);
        Some(nodes)
    }
}

fn nearest(tree: &[Node], goal: &Knot) -> usize {
    (0..tree.len()).min_by(|a, b| (tree[*a].knot - goal).norm().total_cmp(&(tree[*b].knot - goal).norm())).unwrap_or(0)
}

/// From a node back to its root.
fn branch(tree: &[Node], leaf: usize) -> Vec<Node> {
    let mut nodes = vec![tree[leaf]];
    let mut at = leaf;
    while at != 0 {
        at = tree[at].parent;
        nodes.push(tree[at]);
    }
    nodes
}
