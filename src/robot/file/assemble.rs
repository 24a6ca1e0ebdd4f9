//! One robot of a URDF's links and joints: what is fixed is merged, what moves is put in order, what is missing is refused.

use super::body::{ALIGNED_RAD, Body, FindMesh};
use super::description::{Description, JointOverride, MotorEntry, Read};
use super::read_urdf::{JointElement, LinkElement, Urdf, isometry};
use super::tree::{check_names, foot};
use crate::joints::Joints;
use crate::robot::hand::opposing;
use crate::robot::model::{Joint, JointKind, Motor, Posture, Robot};
use crate::words::shown;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

/// What planning keeps a joint within that nothing stops \[rad\]: one turn to either side of a full turn.
const FREE_RAD: [f64; 2] = [-TAU, 4.0 * PI];

struct Assembly<'a> {
    description: &'a Description,
    links: BTreeMap<&'a str, &'a LinkElement>,
    /// Joints by parent link.
    children: BTreeMap<&'a str, Vec<&'a JointElement>>,
    mesh: FindMesh<'a>,
    bodies: Vec<Body>,
    /// Joints in the order of their bodies, from the second.
    joints: Vec<(&'a JointElement, Joint)>,
    remarks: Vec<String>,
}

/// The robot of a description and its URDF; `mesh` finds a mesh by its name.
///
/// # Errors
/// Says what is missing or cannot be, by name, and what to do.
pub fn assemble(description: &Description, urdf: &Urdf, mesh: FindMesh) -> Result<Read, String> {
    let root = foot(urdf)?;
    check_names(description, urdf)?;
    let mut children: BTreeMap<&str, Vec<&JointElement>> = BTreeMap::new();
    urdf.joints.iter().for_each(|joint| children.entry(joint.parent.as_str()).or_default().push(joint));
    let links = urdf.links.iter().map(|link| (link.name.as_str(), link)).collect();
    let mut assembly =
        Assembly { description, links, children, mesh, bodies: vec![Body::new(root)], joints: Vec::new(), remarks: Vec::new() };
    assembly.take(root, 0, Isometry3::identity())?;
    assembly.finish()
}

impl<'a> Assembly<'a> {
    /// Takes in a link, which stands at `at` in the frame of body `body`, and all that hangs on it.
    fn take(&mut self, link: &'a str, body: usize, at: Isometry3<f64>) -> Result<(), String> {
        let (element, own) = (self.links[link], self.description.shapes.get(link));
        self.bodies[body].take(element, at, own, self.mesh, &mut self.remarks)?;
        for joint in self.children.get(link).cloned().unwrap_or_default() {
            let name = shown(&joint.name);
            let place = self.place(joint);
            match (joint.kind.as_str(), place) {
                ("fixed", None) => self.take(&joint.child, body, at * joint.origin)?,
                ("fixed", Some(_)) => return Err(format!("joint \"{name}\" is fixed in the URDF, but named as one that moves")),
                ("revolute" | "continuous" | "prismatic", place) => self.take_moving(joint, place, body, at)?,
                (kind, _) => {
                    let kind = shown(kind);
                    return Err(format!(
                        "line {} of the URDF, joint \"{name}\": type \"{kind}\"; allowed: revolute, continuous, prismatic, fixed",
                        joint.line
                    ));
                }
            }
        }
        Ok(())
    }

    /// Its number among the driven joints.
    fn place(&self, joint: &JointElement) -> Option<usize> {
        let Description { arm, fingers, .. } = self.description;
        arm.iter().chain(fingers).position(|name| *name == joint.name)
    }

    fn take_moving(
        &mut self,
        joint: &'a JointElement,
        place: Option<usize>,
        body: usize,
        at: Isometry3<f64>,
    ) -> Result<(), String> {
        let (name, slides) = (shown(&joint.name), joint.kind == "prismatic");
        let axis = Vector3::from(joint.axis);
        if axis.norm() < ALIGNED_RAD.sqrt() {
            return Err(format!("line {} of the URDF, joint \"{name}\": its axis is no direction: {:?}", joint.line, joint.axis));
        }
        if let Some(held) = self.description.fixed.get(&joint.name) {
            let axis = nalgebra::Unit::new_normalize(axis);
            let moved: Isometry3<f64> = if slides {
                Translation3::from(axis.into_inner() * *held).into()
            } else {
                Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_axis_angle(&axis, *held))
            };
            self.remarks.push(format!("joint {name} is held at {held}"));
            return self.take(&joint.child, body, at * joint.origin * moved);
        }
        let Some(place) = place else {
            let mimics = joint.mimics.as_ref().map(|other| format!(" (it mimics \"{}\")", shown(other))).unwrap_or_default();
            return Err(format!(
                "line {} of the URDF, joint \"{name}\" moves{mimics}, but is neither under arm nor under fingers: name it there, or hold it under [fixed]",
                joint.line
            ));
        };
        let is_finger = place >= self.description.arm.len();
        if slides && !is_finger {
            return Err(format!("joint \"{name}\" of the arm slides; the joints of an arm must turn"));
        }
        if let Some(other) = &joint.mimics {
            if !is_finger {
                return Err(format!("joint \"{name}\" of the arm mimics \"{}\"; hold one of them under [fixed]", shown(other)));
            }
            self.remarks
                .push(format!("finger {name} mimics {} in the URDF; here each finger has a motor of its own", shown(other)));
        }
        // The joint's own frame has its axis as z.
        let z_from_axis = UnitQuaternion::rotation_between(&axis, &Vector3::z())
            .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI));
        let turned = if z_from_axis.angle() < ALIGNED_RAD {
            Isometry3::identity()
        } else {
            Isometry3::from_parts(Translation3::identity(), z_from_axis)
        };
        let origin = at * joint.origin * turned.inverse();
        let made = self.joint(joint, is_finger, body, origin)?;
        self.bodies.push(Body::new(&joint.child));
        self.joints.push((joint, made));
        self.take(&joint.child, self.bodies.len() - 1, turned)
    }

    fn joint(&mut self, element: &JointElement, is_finger: bool, parent: usize, origin: Isometry3<f64>) -> Result<Joint, String> {
        let name = shown(&element.name);
        let own = self.description.joints.get(&element.name).copied().unwrap_or_default();
        let JointOverride { limits, velocity, effort, armature, damping, friction } = own;
        let motors = self.description.motors;
        let all: MotorEntry = if is_finger { motors.fingers } else { motors.arm };
        let needed = |key: &str, told: Option<f64>, found: Option<f64>| match told.or(found) {
            Some(value) if value > 0.0 && value.is_finite() => Ok(value),
            Some(value) => {
                Err(format!("joint \"{name}\": its {key} is {value}, it must be above 0; correct it under [joints.{name}]"))
            }
            None => Err(format!("joint \"{name}\" has no {key} in its <limit>: give it there or under [joints.{name}]")),
        };
        let zero_or_more = |key: &str, told: Option<f64>| match told.unwrap_or(0.0) {
            value if value >= 0.0 && value.is_finite() => Ok(value),
            value => Err(format!("joint \"{name}\": its {key} is {value}; it must be 0 or more")),
        };
        let continuous = element.kind == "continuous" && limits.is_none();
        let limits = match limits.or(element.range) {
            _ if continuous => FREE_RAD,
            Some(range) if range[0] < range[1] && range.iter().all(|v| v.is_finite()) => range,
            Some([low, high]) => {
                return Err(format!("joint \"{name}\" has limits {low} to {high}: the first must be below the second"));
            }
            None => {
                return Err(format!(
                    "joint \"{name}\" has no limits: give lower and upper in its <limit>, or limits under [joints.{name}]"
                ));
            }
        };
        let [urdf_damping, urdf_friction] = element.dynamics;
        Ok(Joint {
            name: element.name.clone(),
            kind: if element.kind == "prismatic" { JointKind::Prismatic } else { JointKind::Revolute },
            parent,
            origin,
            limits,
            continuous,
            velocity: needed("velocity", velocity, element.velocity)?,
            effort: needed("effort", effort, element.effort)?,
            motor: Motor {
                armature: zero_or_more("armature", armature.or(all.armature))?,
                damping: zero_or_more("damping", damping.or(all.damping).or(urdf_damping))?,
                friction: zero_or_more("friction", friction.or(all.friction).or(urdf_friction))?,
            },
        })
    }

    fn finish(self) -> Result<Read, String> {
        let Assembly { description, bodies, joints, mut remarks, .. } = self;
        let wanted: Vec<&String> = description.arm.iter().chain(&description.fingers).collect();
        let found = |name: &str| joints.iter().position(|(element, _)| element.name == name);
        let order = wanted.iter().map(|name| found(name).expect("every named joint was met")).collect::<Vec<_>>();
        // Body b + 1 hangs on joint b as they were met; link i + 1 hangs on joint i in the order asked for.
        let link_of =
            |body: usize| body.checked_sub(1).map_or(0, |b| 1 + order.iter().position(|o| *o == b).expect("all are driven"));
        let arm = description.arm.len();
        let mut made = Vec::new();
        for (i, at) in order.iter().enumerate() {
            let (element, joint) = &joints[*at];
            let parent = link_of(joint.parent);
            if i < arm && parent != i {
                return Err(format!(
                    "arm: joint \"{}\" does not hang on what the joint before it moves; name them from the foot to the hand",
                    shown(&element.name)
                ));
            }
            if i >= arm && parent < arm {
                return Err(format!(
                    "fingers: joint \"{}\" does not hang on the hand, which \"{}\" moves",
                    shown(&element.name),
                    description.arm[arm - 1]
                ));
            }
            if parent > i {
                return Err(format!("fingers: joint \"{}\" hangs on one that is named after it", shown(&element.name)));
            }
            made.push(Joint { parent, ..joint.clone() });
        }
        let mut links = vec![bodies[0].link(true)?];
        for at in &order {
            links.push(bodies[at + 1].link(false)?);
        }
        let hand = &description.hand;
        let ready: Joints = description.ready.iter().chain(&hand.opened).copied().collect();
        for (key, positions) in [("ready or hand.opened", &ready[..]), ("hand.closed", &hand.closed[..])] {
            let from = made.len() - positions.len();
            for (joint, position) in made[from..].iter().zip(positions) {
                let [low, high] = joint.limits;
                if !(low..=high).contains(position) {
                    return Err(format!(
                        "{key}: joint \"{}\" is at {position}, its limits are {low} to {high}",
                        shown(&joint.name)
                    ));
                }
            }
        }
        if let Some([near, far]) = description.reach_m
            && !(0.0 <= near && near < far)
        {
            return Err(format!("reach_m is [{near}, {far}]: allowed: near and far from the foot, 0 or more, the nearer first"));
        }
        let posture = description.posture.iter().map(|(name, position)| Posture {
            joint: description.arm.iter().position(|joint| joint == name).expect("checked"),
            position: *position,
        });
        let mut robot = Robot {
            name: description.name.clone(),
            links,
            joints: made,
            arm,
            tool_m: description.tool.xyz_m,
            tool_from_hand: isometry([0.0; 3], description.tool.rpy_rad).rotation.inverse(),
            ready,
            closed: hand.closed.clone(),
            finger_speed: hand.speed,
            opposing: Vec::new(),
            reach_m: description.reach_m,
            posture: posture.collect(),
        };
        robot.opposing = opposing(&robot).into_iter().map(|opposing| opposing.pair).collect();
        remarks.sort();
        remarks.dedup();
        Ok(Read { robot, remarks })
    }
}
