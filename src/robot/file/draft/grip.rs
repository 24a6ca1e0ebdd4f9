//! How a hand grips: which of its fingers close on each other, how far they open, and where the tool is between them.

use crate::robot::collision::Solid;
use crate::robot::file::description::Tool;
use crate::robot::hand::AGAINST;
use crate::robot::model::Robot;
use nalgebra::{Rotation3, Vector3};

/// A finger reaches at least this share of the way of the longest; what is shorter is a linkage behind it.
const LONG: f64 = 0.85;
/// A finger that goes less than this does not close \[m\].
const MOVES_M: f64 = 1e-3;
/// The hand opens to this at most \[m\]: room of 2.5 cm on each side of a cube of 5 cm.
const WIDE_M: f64 = 0.10;
/// The tool is where it would hold this \[m\].
const BLOCK_M: f64 = 0.05;
/// And this above the finger tips \[m\].
const TIP_M: f64 = 0.01;
/// Steps from the open to the closed hand that are looked at.
const STEPS: usize = 100;

/// How a hand grips.
#[derive(Debug)]
pub struct Grip {
    /// The fingers, counted from the robot's first.
    pub fingers: Vec<usize>,
    /// Position of each in the open hand \[rad, m\].
    pub opened: Vec<f64>,
    /// Position of each that closed around nothing \[rad, m\].
    pub closed: Vec<f64>,
    /// Between their pads.
    pub tool: Tool,
    /// Room between the pads in the open hand \[m\].
    pub room_m: f64,
}

/// A finger at both ends of its way, in the frame of the hand.
struct Finger {
    index: usize,
    /// Open and closed \[rad, m\].
    ends: [f64; 2],
    /// How its tip goes when it closes, across the hand \[m\].
    way: Vector3<f64>,
}

/// Looks at the fingers of a robot, of which only the joints have to be right.
///
/// # Errors
/// When no two of them close on each other.
pub fn grip(robot: &Robot) -> Result<Grip, String> {
    let first = robot.fingers().start;
    let limits = |end: usize| robot.joints[first..].iter().map(|joint| joint.limits[end]).collect::<Vec<f64>>();
    let ends = [solids(robot, &limits(0)), solids(robot, &limits(1))];
    // A hand looks along the axis of the arm's last joint, to the side of its fingers.
    let along: f64 = ends.iter().flatten().flatten().map(|solid| solid.sphere().0.z).sum();
    let approach = Vector3::z() * along.signum();
    let across = |v: Vector3<f64>| v - approach * approach.dot(&v);

    let shaped = (0..ends[0].len()).filter(|f| !ends[0][*f].is_empty());
    let longest = ends.iter().flatten().map(|finger| depth_m(finger, &approach)).fold(f64::NEG_INFINITY, f64::max);
    let long = shaped.filter(|f| ends.iter().any(|end| depth_m(&end[*f], &approach) >= LONG * longest));
    let places = long.map(|f| (f, [0, 1].map(|end| across(middle(tip(&ends[end][f], &approach))))));
    let kept: Vec<(usize, [Vector3<f64>; 2])> = places.filter(|(_, [low, high])| (high - low).norm() > MOVES_M).collect();
    let center = kept.iter().flat_map(|(_, ends)| ends).sum::<Vector3<f64>>() / (2.0 * kept.len().max(1) as f64);
    let fingers: Vec<Finger> = kept
        .into_iter()
        .map(|(f, [low, high])| {
            let joint = &robot.joints[first + f];
            let opens_low = (low - center).norm() > (high - center).norm();
            let [l, h] = joint.limits;
            Finger {
                index: f,
                ends: if opens_low { [l, h] } else { [h, l] },
                way: if opens_low { high - low } else { low - high },
            }
        })
        .collect();
    let pairs = fingers
        .iter()
        .enumerate()
        .flat_map(|(i, a)| fingers[i + 1..].iter().map(move |b| (a.way.normalize(), b.way.normalize())));
    let straightest = pairs.min_by(|(a, b), (c, d)| a.dot(b).total_cmp(&c.dot(d))).filter(|(a, b)| a.dot(b) < AGAINST);
    let Some((one, other)) = straightest else {
        return Err(format!("no two of the {} fingers close on each other", ends[0].len()));
    };
    Ok(Looked { robot, approach, closing: (one - other).normalize(), fingers }.grip())
}

/// What is known of the fingers that close.
struct Looked<'a> {
    robot: &'a Robot,
    approach: Vector3<f64>,
    /// The direction in which one side closes; the other comes against it.
    closing: Vector3<f64>,
    fingers: Vec<Finger>,
}

impl Looked<'_> {
    fn grip(&self) -> Grip {
        let share = |step: usize| step as f64 / STEPS as f64;
        let opened = (0..=STEPS).rev().find(|step| self.room(share(*step)).0 >= WIDE_M).unwrap_or(0);
        let holding = (opened..=STEPS).find(|step| self.room(share(*step)).0 <= BLOCK_M).unwrap_or(opened);
        let at = share(holding);
        let tips: Vec<Solid> = self.tips(at).into_iter().map(|(_, tip)| tip).collect();
        let deep = tips.iter().map(|tip| tip.reach_m(&self.approach)).fold(f64::INFINITY, f64::min) - TIP_M;
        let z = -self.approach;
        let x = self.closing.cross(&z);
        let aside = tips.iter().map(|tip| middle(tip).dot(&x)).sum::<f64>() / tips.len() as f64;
        let point = self.approach * deep + self.closing * self.room(at).1 + x * aside;
        let (roll, pitch, yaw) = Rotation3::from_basis_unchecked(&[x, self.closing, z]).euler_angles();
        Grip {
            fingers: self.fingers.iter().map(|finger| finger.index).collect(),
            opened: self.positions(share(opened)),
            closed: self.positions(1.0),
            tool: Tool { xyz_m: point.into(), rpy_rad: [roll, pitch, yaw] },
            room_m: self.room(share(opened)).0,
        }
    }

    /// Where the fingers are after this share of their way.
    fn positions(&self, share: f64) -> Vec<f64> {
        self.fingers.iter().map(|Finger { ends: [open, closed], .. }| open + share * (closed - open)).collect()
    }

    /// The tips after this share of the way, and whether each closes in the closing direction.
    fn tips(&self, share: f64) -> Vec<(bool, Solid)> {
        let mut all: Vec<f64> = self.robot.ready[self.robot.arm..].to_vec();
        self.fingers.iter().zip(self.positions(share)).for_each(|(finger, position)| all[finger.index] = position);
        let solids = solids(self.robot, &all);
        let tip = |finger: &Finger| (finger.way.dot(&self.closing) > 0.0, *tip(&solids[finger.index], &self.approach));
        self.fingers.iter().map(tip).collect()
    }

    /// Room between the two sides after this share of the way, and the middle of it in the closing direction \[m\].
    fn room(&self, share: f64) -> (f64, f64) {
        let tips = self.tips(share);
        let inner = |side: bool, towards: Vector3<f64>| {
            tips.iter().filter(|(of, _)| *of == side).map(|(_, tip)| tip.reach_m(&towards)).fold(f64::NEG_INFINITY, f64::max)
        };
        let (from, to) = (inner(true, self.closing), -inner(false, -self.closing));
        (to - from, (from + to) / 2.0)
    }
}

/// The primitives of each finger with all fingers at `positions`, in the frame of the hand.
fn solids(robot: &Robot, positions: &[f64]) -> Vec<Vec<Solid>> {
    let mut q = robot.ready;
    q[robot.arm..].copy_from_slice(positions);
    let poses = robot.link_poses(&q);
    let hand = poses[robot.hand()];
    let of = |joint: usize| {
        robot.links[joint + 1].shapes.iter().map(|shape| Solid::of(shape, &(hand.inverse() * poses[joint + 1]))).collect()
    };
    robot.fingers().map(of).collect()
}

fn middle(solid: &Solid) -> Vector3<f64> {
    solid.sphere().0.coords
}

/// How far a finger reaches \[m\].
fn depth_m(finger: &[Solid], approach: &Vector3<f64>) -> f64 {
    finger.iter().map(|solid| solid.reach_m(approach)).fold(f64::NEG_INFINITY, f64::max)
}

/// The primitive of a finger that reaches farthest.
fn tip<'a>(finger: &'a [Solid], approach: &Vector3<f64>) -> &'a Solid {
    finger.iter().max_by(|a, b| a.reach_m(approach).total_cmp(&b.reach_m(approach))).expect("fingers without shapes are left out")
}
