//! What there is to know about a robot before it is used: what is doubtful, where its hand gets to, how well it moves there.

use super::collision::{Clash, Solid};
use super::hand::opposing;
use super::ik::Ik;
use super::model::{Jacobian, Joint, JointKind, Robot};
use super::motors::{ARM_ARMATURE, FINGER_FRICTION, TooStrong, finger_armature, too_strong};
use crate::error::Result;
use crate::interrupt::Interrupt;
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use serde::Serialize;
use std::ops::Range;
use std::sync::Arc;

/// Links nearer to each other than this in the ready pose are doubtful \[m\].
pub const CLEAR_M: f64 = 0.005;
/// A hand that leans more than this from straight down in the ready pose is doubtful \[rad\].
const LEVEL_RAD: f64 = 0.02;
/// Height of the tool over the table at which the reach is looked at \[m\]: a grasp of a block of 5 cm.
pub const REACH_HEIGHT_M: f64 = 0.03;
/// Room of the reach map around the foot \[m\].
const REACH_X_M: [f64; 2] = [0.10, 1.00];
const REACH_Y_M: [f64; 2] = [-0.60, 0.60];
/// Grid of the reach map \[m\].
pub const GRID_M: f64 = 0.05;
/// Manipulability below which the hand moves badly, as a share of the best on the map.
const POOR: f64 = 0.25;
/// Gravity \[m/s^2\].
const GRAVITY_M_S2: f64 = 9.81;
/// A turn with more than this to spare is no limit at all \[rad\].
const WIDE_RAD: f64 = 4.0 * std::f64::consts::PI;
/// Published moments of inertia are rounded.
const ROUNDED: f64 = 1.02;
/// Masses outside of this are doubtful \[kg\].
const MASS_KG: Range<f64> = 0.001..50.0;

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub struct Findings {
    /// What may be wrong, in words.
    pub doubts: Vec<String>,
    /// Where the tool is in the ready pose \[m\].
    pub ready_tool_m: [f64; 3],
    /// The two fingers that oppose each other best, if any two do.
    pub opposing: Option<[String; 2]>,
    /// Room between them in the open hand \[m\].
    pub opening_m: Option<f64>,
    /// Where the hand gets to, pointing straight down.
    pub reach: Reach,
}

/// Where the hand gets to, pointing straight down at yaw 0, the tool [`Reach::height_m`] over the table.
#[derive(Clone, Debug, Serialize)]
pub struct Reach {
    /// \[m\].
    pub height_m: f64,
    /// x of the rows \[m\].
    pub x_m: Vec<f64>,
    /// y of the columns \[m\].
    pub y_m: Vec<f64>,
    /// Manipulability, the product of the Jacobian's singular values, x by y; `None` where the hand does not get to.
    pub manipulability: Vec<Vec<Option<f64>>>,
    /// Nearest and farthest place straight ahead of the foot \[m\].
    pub ahead_m: Option<[f64; 2]>,
}

/// Looks at a robot.
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub fn check(robot: &Arc<Robot>, interrupt: &Interrupt) -> Result<Findings> {
    let poses = robot.link_poses(&robot.ready);
    let mut doubts = Vec::new();
    doubt_numbers(robot, &mut doubts);
    doubt_motors(robot, &mut doubts);
    doubt_ready(robot, &poses, &mut doubts);
    doubt_strength(robot, &poses, &mut doubts);
    let opposing = opposing(robot).into_iter().min_by(|a, b| a.cosine.total_cmp(&b.cosine));
    if opposing.is_none() {
        doubts.push("no two fingers close on each other: none can hold a block against another".into());
    }
    let reach = reach(robot, interrupt)?;
    if let (None, Some([near, far])) = (robot.reach_m, reach.ahead_m) {
        doubts.push(format!("reach_m is not said: scenes are drawn where the hand does not get to; straight ahead it gets from {near:.2} to {far:.2} m"));
    }
    match reach.ahead_m {
        None => doubts.push(format!("nowhere straight ahead does the hand get down to {REACH_HEIGHT_M} m over the table")),
        Some([near, far]) if far - near < 2.0 * GRID_M => {
            doubts.push(format!("straight ahead the hand gets down to the table from {near:.2} to {far:.2} m only"));
        }
        Some(_) => {}
    }
    Ok(Findings {
        doubts,
        ready_tool_m: robot.tool_of(&poses).translation.vector.into(),
        opening_m: opposing.as_ref().map(|found| found.room_m),
        opposing: opposing.map(|found| found.pair.map(|i| robot.joints[robot.arm + i].name.clone())),
        reach,
    })
}

fn doubt_numbers(robot: &Robot, doubts: &mut Vec<String>) {
    for link in &robot.links[1..] {
        if !MASS_KG.contains(&link.inertia.mass_kg) {
            doubts.push(format!("link {} weighs {} kg", link.name, link.inertia.mass_kg));
        }
        let moments = link.inertia.principal_kg_m2;
        let (sum, largest) = (moments.iter().sum::<f64>(), moments.iter().fold(0.0f64, |most, m| most.max(*m)));
        if 2.0 * largest > sum * ROUNDED {
            let [a, b, c] = moments;
            doubts.push(format!(
                "link {}: moments of inertia {a:.2e}, {b:.2e}, {c:.2e} kg m^2 are no body's: one is above the sum of the others",
                link.name
            ));
        }
        if link.shapes.is_empty() {
            doubts.push(format!("link {} has no collision shape: nothing keeps it from going through things", link.name));
        }
    }
    for joint in &robot.joints {
        let [low, high] = joint.limits;
        if joint.kind == JointKind::Revolute && !joint.continuous && high - low > WIDE_RAD {
            doubts.push(format!("joint {} turns by {:.1} rad: is it continuous?", joint.name, high - low));
        }
    }
}

/// What neither URDF nor TOML says of the motors is none, and few hands hold with that.
fn doubt_motors(robot: &Robot, doubts: &mut Vec<String>) {
    let named = |joints: Range<usize>, lacks: fn(&Joint) -> bool| {
        let lacking: Vec<&str> =
            robot.joints[joints].iter().filter(|joint| lacks(joint)).map(|joint| joint.name.as_str()).collect();
        (!lacking.is_empty()).then(|| lacking.join(", "))
    };
    for (part, joints, begin) in [("arm", 0..robot.arm, ARM_ARMATURE), ("fingers", robot.fingers(), finger_armature(robot))] {
        if let Some(names) = named(joints, |joint| joint.motor.armature == 0.0) {
            doubts.push(format!(
                "no reflected inertia (armature) in the motors of {names}: light links shake; to begin with: armature = {begin} under [motors.{part}]"
            ));
        }
    }
    if let Some(names) = named(robot.fingers(), |joint| joint.motor.friction == 0.0) {
        doubts.push(format!(
            "no dry friction in the motors of {names}: what they hold pushes them open, and noise closes them; to begin with: {FINGER_FRICTION} of the \
             effort as friction under [motors.fingers]"
        ));
    }
    for TooStrong { joint, press_n, effort } in too_strong(robot) {
        let name = &robot.joints[joint].name;
        doubts.push(format!(
            "finger {name} presses with {press_n:.0} N: grippers have 20 to 235 N, and what is pressed harder slips away; to begin with: effort = {effort:.2} \
             under [joints.{name}]"
        ));
    }
}

fn doubt_ready(robot: &Robot, poses: &[Isometry3<f64>], doubts: &mut Vec<String>) {
    let tool = robot.tool_of(poses);
    let lean = (tool.rotation * Vector3::z()).angle(&Vector3::z());
    if lean > LEVEL_RAD {
        doubts.push(format!(
            "in the ready pose the hand leans {:.1} degrees from straight down (tool.rpy_rad, ready)",
            lean.to_degrees()
        ));
    }
    let point = Solid::Capsule { from: tool.translation.vector.into(), to: tool.translation.vector.into(), radius_m: 0.0 };
    if let Some((link, _)) = robot.solids(poses).iter().find(|(_, solid)| solid.distance_m(&point) <= 0.0) {
        doubts.push(format!(
            "the tool point lies inside of link {}: it is to be between the finger pads (tool.xyz_m)",
            robot.links[*link].name
        ));
    }
    for clash in robot.clashes(poses, CLEAR_M) {
        let name = |link: usize| &robot.links[link].name;
        doubts.push(match clash {
            Clash::Table(link) => format!("in the ready pose link {} is in the table", name(link)),
            Clash::Links(a, b) => {
                format!("in the ready pose link {} comes within {:.0} mm of link {}", name(a), CLEAR_M * 1e3, name(b))
            }
        });
    }
}

/// Whether the motors bear the links' own weight in the ready pose.
fn doubt_strength(robot: &Robot, poses: &[Isometry3<f64>], doubts: &mut Vec<String>) {
    for (i, joint) in robot.joints[..robot.arm].iter().enumerate() {
        let (axis, at) = (poses[i + 1].rotation * Vector3::z(), poses[i + 1].translation.vector);
        let torque: f64 = (i + 1..robot.links.len())
            .map(|link| {
                let inertia = &robot.links[link].inertia;
                let com = (poses[link] * Point3::from(inertia.com_m)).coords;
                axis.dot(&(com - at).cross(&Vector3::new(0.0, 0.0, -GRAVITY_M_S2 * inertia.mass_kg)))
            })
            .sum();
        if torque.abs() > joint.effort {
            let (name, effort) = (&joint.name, joint.effort);
            doubts.push(format!(
                "joint {name} bears {:.1} N m of weight in the ready pose, its effort is {effort} N m",
                torque.abs()
            ));
        }
    }
}

/// Where the hand gets to.
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub fn reach(robot: &Arc<Robot>, interrupt: &Interrupt) -> Result<Reach> {
    let line = |[low, high]: [f64; 2]| -> Vec<f64> {
        let steps = ((high - low) / GRID_M).round() as usize;
        (0..=steps).map(|k| low + k as f64 * GRID_M).collect()
    };
    let (x_m, y_m) = (line(REACH_X_M), line(REACH_Y_M));
    let mut ik = Ik::new(robot);
    let mut rows = Vec::new();
    for x in &x_m {
        interrupt.check()?;
        let row = y_m.iter().map(|y| {
            let target = Isometry3::from_parts(Translation3::new(*x, *y, REACH_HEIGHT_M), UnitQuaternion::identity());
            ik.solve(&target, &robot.ready).ok().map(|q| {
                let (_, jacobian) = robot.tool_jacobian(&q);
                manipulability(&jacobian)
            })
        });
        rows.push(row.collect::<Vec<_>>());
    }
    let middle = y_m.iter().position(|y| y.abs() < GRID_M / 2.0).unwrap_or(0);
    let ahead: Vec<f64> = x_m.iter().zip(&rows).filter(|(_, row)| row[middle].is_some()).map(|(x, _)| *x).collect();
    let ahead_m = ahead.first().zip(ahead.last()).map(|(near, far)| [*near, *far]);
    Ok(Reach { height_m: REACH_HEIGHT_M, x_m, y_m, manipulability: rows, ahead_m })
}

/// Product of the singular values: sqrt(det(J J^T)), or with fewer than six joints sqrt(det(J^T J)).
fn manipulability(jacobian: &Jacobian) -> f64 {
    let square = if jacobian.ncols() < 6 {
        jacobian.tr_mul(jacobian).determinant()
    } else {
        (jacobian * jacobian.transpose()).determinant()
    };
    square.max(0.0).sqrt()
}

impl Reach {
    /// The map as text, the foot below its lower edge: `#` where the hand gets to, `+` where it moves badly there, `.` where it does not.
    pub fn map(&self) -> String {
        let best = self.manipulability.iter().flatten().flatten().fold(0.0f64, |best, value| best.max(*value));
        let sign = |value: &Option<f64>| match value {
            None => '.',
            Some(value) if *value < POOR * best => '+',
            Some(_) => '#',
        };
        // Left is +y, as one sees it who stands behind the foot.
        let rows = self.x_m.iter().zip(&self.manipulability).rev();
        rows.map(|(x, row)| format!("{x:5.2} m  {}\n", row.iter().rev().map(sign).collect::<String>())).collect()
    }
}
