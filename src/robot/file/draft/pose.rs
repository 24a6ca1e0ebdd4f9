//! A ready pose: the hand down, in front of the foot, from where it gets to most of the table.

use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::joints::Joints;
use crate::robot::check::{CLEAR_M, REACH_HEIGHT_M};
use crate::robot::ik::Ik;
use crate::robot::model::{Joint, Robot};
use crate::seed;
use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use rand::RngExt;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// How far in front of the foot the tool waits \[m\]: where the tasks that come with hilt have their objects; small arms wait nearer.
const AHEAD_M: f64 = 0.45;
/// Where a pose is looked for, the best first \[m\].
const TRIED_M: [f64; 7] = [AHEAD_M, 0.40, 0.35, 0.30, 0.25, 0.20, 0.15];
/// And how high \[m\].
const HEIGHT_M: f64 = 0.30;
/// Poses from which the inverse kinematics begins: an arm of six joints has up to eight solutions.
const BEGINNINGS: u64 = 80;
/// Solutions nearer to each other than this are one \[rad\].
const SAME_RAD: f64 = 0.05;
/// Where the hand should get to on the table, in front of the foot and to the sides of it \[m\].
const TABLE_X_M: [f64; 6] = [0.2, 0.3, 0.4, 0.5, 0.6, 0.7];
const TABLE_Y_M: [f64; 3] = [-0.25, 0.0, 0.25];

/// A pose to begin with.
pub struct Pose {
    /// The arm's joints \[rad\].
    pub ready: Vec<f64>,
    /// Whether the tool was turned by half a turn about its z axis.
    pub turned: bool,
    /// The joint that the tool's pose leaves free, of an arm with more than six.
    pub free: Option<usize>,
}

/// The better, the greater: fewer clashes, more of the table, a higher arm, less turned joints.
type Score = (i64, i64, i64, i64);

/// The best pose that was found, if there is one.
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub fn pose(robot: &Arc<Robot>, interrupt: &Interrupt) -> Result<Option<Pose>> {
    let mut ik = Ik::new(robot);
    for x in TRIED_M {
        let (mut seen, mut best) = (Vec::<Joints>::new(), None::<(Score, bool, Joints)>);
        for beginning in 0..BEGINNINGS {
            interrupt.check()?;
            let begin = anywhere(robot, beginning);
            for turned in [false, true] {
                let Ok(found) = ik.solve(&down([x, 0.0, HEIGHT_M], turned), &begin) else { continue };
                let q = unwound(robot, found);
                if seen.iter().any(|known| known.iter().zip(q.iter()).all(|(a, b)| (a - b).abs() < SAME_RAD)) {
                    continue;
                }
                seen.push(q);
                let score = score(robot, &mut ik, &q, turned);
                if best.as_ref().is_none_or(|(known, ..)| score > *known) {
                    best = Some((score, turned, q));
                }
            }
        }
        if let Some((_, turned, q)) = best {
            return Ok(Some(Pose { ready: q[..robot.arm].to_vec(), turned, free: free(robot, &q) }));
        }
    }
    Ok(None)
}

/// The same pose in the middle of what the hand reaches straight ahead, if that is nearer, with the posture of the robot; `None` where it cannot be.
pub fn settled(robot: &Arc<Robot>, [near, far]: [f64; 2]) -> Option<Vec<f64>> {
    let x = AHEAD_M.min((near + far) / 2.0);
    let q = Ik::new(robot).solve(&down([x, 0.0, HEIGHT_M], false), &robot.ready).ok()?;
    Some(unwound(robot, q)[..robot.arm].to_vec())
}

fn down([x, y, z]: [f64; 3], turned: bool) -> Isometry3<f64> {
    let yaw = if turned { PI } else { 0.0 };
    Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_euler_angles(0.0, 0.0, yaw))
}

/// Joint positions drawn within the limits, no more than half a turn from 0 where a joint turns round.
fn anywhere(robot: &Robot, index: u64) -> Joints {
    let mut rng = seed::stream(0, "robot.draft", index);
    let mut q = robot.ready;
    for (slot, joint) in q.iter_mut().zip(&robot.joints[..robot.arm]) {
        let [low, high] = if turns_round(joint) { [-PI, PI] } else { joint.limits.map(|limit| limit.clamp(-TAU, TAU)) };
        *slot = rng.random_range(low..=high);
    }
    q
}

fn turns_round(joint: &Joint) -> bool {
    joint.continuous || joint.limits[1] - joint.limits[0] >= TAU && joint.limits[0] <= -PI && joint.limits[1] >= PI
}

/// The same pose, each joint that turns round as near to 0 as can be.
fn unwound(robot: &Robot, mut q: Joints) -> Joints {
    for (slot, joint) in q.iter_mut().zip(&robot.joints[..robot.arm]) {
        if turns_round(joint) {
            *slot -= TAU * (*slot / TAU).round();
        }
    }
    q
}

fn score(robot: &Robot, ik: &mut Ik, ready: &Joints, turned: bool) -> Score {
    let clashes = |q: &Joints| robot.clashes(&robot.link_poses(q), CLEAR_M).len() as i64;
    let table = TABLE_X_M.iter().flat_map(|x| TABLE_Y_M.map(|y| [*x, y, REACH_HEIGHT_M]));
    let reached = table.filter(|at| ik.solve(&down(*at, turned), ready).is_ok_and(|q| clashes(&q) == 0)).count() as i64;
    let poses = robot.link_poses(ready);
    let height_cm = poses[1..=robot.arm].iter().map(|pose| pose.translation.z * 100.0).sum::<f64>().round() as i64;
    let turn: f64 = ready[..robot.arm].iter().map(|q| q.abs()).sum();
    (-clashes(ready), reached, height_cm, -(turn * 100.0).round() as i64)
}

/// The joint that moves most when the arm moves and the tool does not; not the first, which turns the arm to where it works.
fn free(robot: &Robot, q: &Joints) -> Option<usize> {
    let (_, jacobian) = robot.tool_jacobian(q);
    if jacobian.ncols() <= jacobian.nrows() {
        return None;
    }
    let square = (jacobian.tr_mul(&jacobian)).symmetric_eigen();
    let still = square.eigenvectors.column(square.eigenvalues.imin());
    (1..still.len()).max_by(|a, b| still[*a].abs().total_cmp(&still[*b].abs()))
}
