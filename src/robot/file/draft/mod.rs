//! A first description of a robot from its URDF alone: which joints are the arm's and the fingers', where the tool is, a ready pose, what to begin
//! with for the motors. A person goes on from there.

mod grip;
mod pose;
mod skeleton;
mod text;

use super::assemble::assemble;
use super::body::FindMesh;
use super::description::{Description, Hand, JointOverride, MotorEntry, Motors, Tool};
use super::read_urdf::{JointElement, Urdf};
use super::tree::foot;
use crate::error::{Error, Result};
use crate::interrupt::Interrupt;
use crate::robot::check::{GRID_M, reach};
use crate::robot::file::read_urdf::isometry;
use crate::robot::model::Robot;
use crate::robot::motors::{ARM_ARMATURE, ARM_DAMPING, FINGER_FRICTION, finger_armature, too_strong};
use grip::{Grip, grip};
use nalgebra::{UnitQuaternion, Vector3};
use pose::{Pose, pose, settled};
use skeleton::{Skeleton, held_at, skeleton};
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;
use text::{Drafted, text};

/// A finger closes in this time \[s\], unless half its highest speed is slower.
const CLOSING_S: f64 = 0.5;

/// The TOML that is to stand beside the URDF at `path`.
///
/// # Errors
/// [`Error::Input`] says what cannot be made of the URDF; [`Error::Interrupted`].
pub(super) fn draft(path: &Path, urdf: &Urdf, mesh: FindMesh, interrupt: &Interrupt) -> Result<String> {
    let refuse = |why: String| Error::input(path, why);
    let build = |description: &Description| assemble(description, urdf, mesh).map(|read| Arc::new(read.robot)).map_err(refuse);

    let bones = foot(urdf).and_then(|foot| skeleton(urdf, foot)).map_err(refuse)?;
    let mut description = begun(path, bones, urdf);
    let branches = build(&description)?;
    let Grip { fingers, opened, closed, tool, room_m } = grip(&branches).map_err(refuse)?;
    let speed = closing_speed(&branches, &fingers, &opened, &closed);
    hold_others(&mut description, &fingers, urdf);
    (description.tool, description.hand) = (tool, Hand { opened, closed, speed });

    let found = pose(&build(&description)?, interrupt)?;
    let ready_found = found.is_some();
    if let Some(Pose { ready, turned, free }) = found {
        if turned {
            description.tool.rpy_rad = half_turned(description.tool.rpy_rad);
        }
        // The arm bends in its own plane where it can.
        let straight = |joint: usize| {
            let [low, high] = branches.joints[joint].limits;
            (description.arm[joint].clone(), 0.0f64.clamp(low, high))
        };
        description.posture = free.map(straight).into_iter().collect();
        description.ready = ready;
    }
    let unpowered = build(&description)?;
    take_motors(&mut description, &unpowered, urdf);
    let robot = build(&description)?;
    // One step of the map's grid less at both ends.
    let reach = reach(&robot, interrupt)?.ahead_m;
    description.reach_m = reach.map(|[near, far]| [near + GRID_M, far - GRID_M]).filter(|[near, far]| near < far);
    if let Some(ready) = description.reach_m.and_then(|reach| settled(&robot, reach)) {
        description.ready = ready;
    }
    Ok(text(&Drafted { description, room_m, ready_found }))
}

fn element<'a>(urdf: &'a Urdf, name: &str) -> Option<&'a JointElement> {
    urdf.joints.iter().find(|joint| joint.name == name)
}

/// A description that can be assembled, in which the joints alone are right.
fn begun(path: &Path, Skeleton { arm, fingers, fixed }: Skeleton, urdf: &Urdf) -> Description {
    let range = |name: &String| element(urdf, name).and_then(|joint| joint.range);
    let middle = |names: &[String]| -> Vec<f64> {
        names.iter().map(|name| range(name).map_or(0.0, |[low, high]| (low + high) / 2.0)).collect()
    };
    let (ready, opened) = (middle(&arm), middle(&fingers));
    // A joint that mimics another often has no limits of its own.
    let lacks = |name: &String| {
        let joint = element(urdf, name)?;
        let other = element(urdf, joint.mimics.as_ref()?)?;
        let own = JointOverride {
            velocity: other.velocity.filter(|_| joint.velocity.is_none()),
            effort: other.effort.filter(|_| joint.effort.is_none()),
            ..JointOverride::default()
        };
        (own.velocity.is_some() || own.effort.is_some()).then(|| (name.clone(), own))
    };
    let joints = fingers.iter().filter_map(lacks).collect();
    Description {
        name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        urdf: path.file_name().unwrap_or_default().into(),
        arm,
        fingers,
        fixed,
        tool: Tool { xyz_m: [0.0; 3], rpy_rad: [0.0; 3] },
        ready,
        reach_m: None,
        hand: Hand { closed: opened.clone(), opened, speed: 1.0 },
        posture: BTreeMap::new(),
        motors: Motors::default(),
        joints,
        shapes: BTreeMap::new(),
        packages: BTreeMap::new(),
    }
}

/// Of the branches of the hand these `fingers` close; the others are held.
fn hold_others(description: &mut Description, fingers: &[usize], urdf: &Urdf) {
    let branches = std::mem::take(&mut description.fingers);
    for (i, name) in branches.into_iter().enumerate() {
        if fingers.contains(&i) {
            description.fingers.push(name);
        } else {
            description.joints.remove(&name);
            let at = element(urdf, &name).map_or(0.0, held_at);
            description.fixed.insert(name, at);
        }
    }
}

fn closing_speed(robot: &Robot, fingers: &[usize], opened: &[f64], closed: &[f64]) -> f64 {
    let ways = opened.iter().zip(closed).map(|(open, closed)| (closed - open).abs() / CLOSING_S);
    let speeds = ways.zip(fingers).map(|(speed, f)| speed.min(robot.joints[robot.arm + f].velocity / 2.0));
    speeds.fold(f64::INFINITY, f64::min)
}

/// The tool's axes after half a turn about its z axis.
fn half_turned(rpy_rad: [f64; 3]) -> [f64; 3] {
    let turned = isometry([0.0; 3], rpy_rad).rotation * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), PI);
    turned.euler_angles().into()
}

/// What neither the URDF says nor anybody publishes.
fn take_motors(description: &mut Description, robot: &Robot, urdf: &Urdf) {
    let of = |name: &String, k: usize| element(urdf, name).and_then(|joint| joint.dynamics[k]);
    let said = |names: &[String], k: usize| names.iter().all(|name| of(name, k).is_some_and(|value| value > 0.0));
    let mut efforts: Vec<f64> = robot.fingers().map(|joint| robot.joints[joint].effort).collect();
    for strong in too_strong(robot) {
        efforts[strong.joint - robot.arm] = strong.effort;
        let name = robot.joints[strong.joint].name.clone();
        description.joints.entry(name).or_default().effort = Some(strong.effort);
    }
    let weakest = efforts.iter().copied().fold(f64::INFINITY, f64::min);
    description.motors = Motors {
        arm: MotorEntry {
            armature: Some(ARM_ARMATURE),
            damping: (!said(&description.arm, 0)).then_some(ARM_DAMPING),
            friction: None,
        },
        fingers: MotorEntry {
            armature: Some(finger_armature(robot)),
            damping: None,
            friction: (!said(&description.fingers, 1)).then_some(FINGER_FRICTION * weakest),
        },
    };
}
