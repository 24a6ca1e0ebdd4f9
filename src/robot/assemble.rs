//! One robot of a URDF's links and joints: what is fixed is merged, what moves is put in order, what is missing is refused.

use super::description::{Description, JointOverride, MotorEntry, Read, ShapeEntry};
use super::mesh::bounds_of_stl;
use super::model::{Inertia, Joint, JointKind, Link, Motor, Posture, Robot, Shape};
use super::xml::{Geometry, JointElement, LinkElement, Urdf, isometry};
use crate::words::{did_you_mean, shown};
use nalgebra::{Isometry3, Matrix3, Point3, Translation3, UnitQuaternion, Vector3};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::{PI, TAU};
use std::path::PathBuf;

/// What planning keeps a joint within that nothing stops \[rad\]: one turn to either side of a full turn.
const FREE_RAD: [f64; 2] = [-TAU, 4.0 * PI];
/// Most links of a document: each costs a look at its joints.
const MOST_LINKS: usize = 256;
/// Joints of the longest arm.
const MOST_ARM_JOINTS: usize = crate::layout::MOST_ARM_JOINTS;
/// Most fingers.
const MOST_FINGERS: usize = 5;
/// Rotations nearer to none than this are none \[rad\].
const ALIGNED_RAD: f64 = 1e-12;
/// Ends of a capsule are recognised within this \[m\].
const SAME_M: f64 = 1e-9;

/// What of a robot moves together: links that are fixed to each other, in the frame of the first.
struct Body {
    name: String,
    masses: Vec<(Isometry3<f64>, f64, Matrix3<f64>)>,
    shapes: Vec<Shape>,
}

struct Assembly<'a> {
    description: &'a Description,
    links: BTreeMap<&'a str, &'a LinkElement>,
    /// Joints by parent link.
    children: BTreeMap<&'a str, Vec<&'a JointElement>>,
    mesh: &'a dyn Fn(&str) -> Result<PathBuf, String>,
    bodies: Vec<Body>,
    /// Joints in the order of their bodies, from the second.
    joints: Vec<(&'a JointElement, Joint)>,
    remarks: Vec<String>,
}

/// The robot of a description and its URDF; `mesh` finds a mesh by its name.
///
/// # Errors
/// Says what is missing or cannot be, by name, and what to do.
pub fn assemble(description: &Description, urdf: &Urdf, mesh: &dyn Fn(&str) -> Result<PathBuf, String>) -> Result<Read, String> {
    let root = check_tree(urdf)?;
    check_names(description, urdf)?;
    let mut children: BTreeMap<&str, Vec<&JointElement>> = BTreeMap::new();
    urdf.joints.iter().for_each(|joint| children.entry(joint.parent.as_str()).or_default().push(joint));
    let links = urdf.links.iter().map(|link| (link.name.as_str(), link)).collect();
    let foot = Body { name: root.into(), masses: Vec::new(), shapes: Vec::new() };
    let mut assembly =
        Assembly { description, links, children, mesh, bodies: vec![foot], joints: Vec::new(), remarks: Vec::new() };
    assembly.take(root, 0, Isometry3::identity())?;
    assembly.finish()
}

/// The one link that hangs on nothing.
fn check_tree(urdf: &Urdf) -> Result<&str, String> {
    if urdf.links.is_empty() || urdf.links.len() > MOST_LINKS {
        return Err(format!("the URDF has {} links; allowed: 1 to {MOST_LINKS}", urdf.links.len()));
    }
    let mut names = BTreeSet::new();
    if let Some(twice) = urdf.links.iter().find(|link| !names.insert(link.name.as_str())) {
        return Err(format!("line {}: two links are called \"{}\"", twice.line, shown(&twice.name)));
    }
    let (mut joints, mut parents) = (BTreeSet::new(), BTreeMap::new());
    for joint in &urdf.joints {
        let name = shown(&joint.name);
        if !joints.insert(joint.name.as_str()) {
            return Err(format!("line {}: two joints are called \"{name}\"", joint.line));
        }
        if let Some(unknown) = [&joint.parent, &joint.child].into_iter().find(|link| !names.contains(link.as_str())) {
            let known: Vec<&str> = names.iter().copied().collect();
            let hint = did_you_mean(unknown, known);
            return Err(format!("line {}, joint \"{name}\": there is no link \"{}\"{hint}", joint.line, shown(unknown)));
        }
        if let Some(other) = parents.insert(joint.child.as_str(), joint) {
            let (link, other) = (shown(&joint.child), shown(&other.name));
            return Err(format!(
                "line {}: link \"{link}\" hangs on two joints, \"{other}\" and \"{name}\": a robot is a tree",
                joint.line
            ));
        }
    }
    let roots: Vec<&str> = urdf.links.iter().map(|link| link.name.as_str()).filter(|name| !parents.contains_key(name)).collect();
    let root = match roots[..] {
        [root] => root,
        [] => return Err("every link hangs on another: the joints make a loop; one link must be the foot".into()),
        [first, second, ..] => {
            let (first, second) = (shown(first), shown(second));
            return Err(format!(
                "links \"{first}\" and \"{second}\" both hang on nothing: one link is the foot, all others hang on it"
            ));
        }
    };
    // Up from a link of a loop one never comes to the foot.
    let looping = urdf.links.iter().find(|link| {
        let mut at = link.name.as_str();
        (0..urdf.links.len()).all(|_| {
            parents.get(at).is_some_and(|joint: &&JointElement| {
                at = joint.parent.as_str();
                true
            })
        })
    });
    match looping {
        None => Ok(root),
        Some(link) => Err(format!("line {}: link \"{}\" hangs on itself: its joints make a loop", link.line, shown(&link.name))),
    }
}

/// Every joint and link that the description names is there, and is named once.
fn check_names(description: &Description, urdf: &Urdf) -> Result<(), String> {
    let joints: Vec<&str> = urdf.joints.iter().map(|joint| joint.name.as_str()).collect();
    let links: Vec<&str> = urdf.links.iter().map(|link| link.name.as_str()).collect();
    let known = |key: &str, what: &str, name: &str, all: &[&str]| match all.contains(&name) {
        true => Ok(()),
        false => Err(format!("{key}: there is no {what} \"{}\" in the URDF{}", shown(name), did_you_mean(name, all.to_vec()))),
    };
    let driven = || description.arm.iter().map(|n| ("arm", n)).chain(description.fingers.iter().map(|n| ("fingers", n)));
    let held = description.fixed.keys().map(|n| ("fixed", n));
    let mut seen = BTreeSet::new();
    for (key, name) in driven().chain(held) {
        known(key, "joint", name, &joints)?;
        if !seen.insert(name) {
            return Err(format!("{key}: joint \"{}\" is named twice among arm, fingers and fixed", shown(name)));
        }
    }
    for (key, names) in [("joints", description.joints.keys())].into_iter() {
        for name in names {
            known(key, "joint", name, &joints)?;
        }
    }
    for name in description.posture.keys() {
        if !description.arm.contains(name) {
            let arm: Vec<&str> = description.arm.iter().map(String::as_str).collect();
            return Err(format!("posture: \"{}\" is no joint of the arm{}", shown(name), did_you_mean(name, arm)));
        }
    }
    description.shapes.keys().try_for_each(|name| known("shapes", "link", name, &links))?;
    let (arm, fingers) = (description.arm.len(), description.fingers.len());
    if !(1..=MOST_ARM_JOINTS).contains(&arm) || !(2..=MOST_FINGERS).contains(&fingers) {
        return Err(format!(
            "an arm of {arm} joints and {fingers} fingers; allowed: 1 to {MOST_ARM_JOINTS} joints, 2 to {MOST_FINGERS} fingers"
        ));
    }
    let hand = &description.hand;
    for (key, found, needed) in [
        ("ready", description.ready.len(), arm),
        ("hand.opened", hand.opened.len(), fingers),
        ("hand.closed", hand.closed.len(), fingers),
    ] {
        if found != needed {
            return Err(format!("{key} has {found} positions, {needed} are needed, one a joint"));
        }
    }
    if !(hand.speed > 0.0 && hand.speed.is_finite()) {
        return Err(format!("hand.speed is {}; it must be above 0", hand.speed));
    }
    Ok(())
}

impl<'a> Assembly<'a> {
    /// Takes in a link, which stands at `at` in the frame of body `body`, and all that hangs on it.
    fn take(&mut self, link: &'a str, body: usize, at: Isometry3<f64>) -> Result<(), String> {
        self.take_link(self.links[link], body, at)?;
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
                        "line {}, joint \"{name}\": type \"{kind}\"; allowed: revolute, continuous, prismatic, fixed",
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
            return Err(format!("line {}, joint \"{name}\": its axis is no direction: {:?}", joint.line, joint.axis));
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
                "line {}, joint \"{name}\" moves{mimics}, but is neither under arm nor under fingers: name it there, or hold it under [fixed]",
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
        let (mass, shapes) = (Vec::new(), Vec::new());
        self.bodies.push(Body { name: joint.child.clone(), masses: mass, shapes });
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

    fn take_link(&mut self, link: &LinkElement, body: usize, at: Isometry3<f64>) -> Result<(), String> {
        if let Some((com, mass, [xx, yy, zz, xy, xz, yz])) = link.inertial {
            let moments = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
            self.bodies[body].masses.push((at * com, mass, moments));
        }
        let shapes = match self.description.shapes.get(&link.name) {
            Some(own) => own.iter().map(own_shape).collect(),
            None => self.shapes(link)?,
        };
        let placed = |shape: Shape| match shape {
            Shape::Box { pose, half_m } => Shape::Box { pose: at * pose, half_m },
            Shape::Capsule { from_m, to_m, radius_m } => {
                let moved = |p: [f64; 3]| (at * Point3::from(p)).coords.into();
                Shape::Capsule { from_m: moved(from_m), to_m: moved(to_m), radius_m }
            }
        };
        let shapes = shapes.into_iter().map(|shape| if at == Isometry3::identity() { shape } else { placed(shape) });
        self.bodies[body].shapes.extend(shapes);
        Ok(())
    }

    /// What hilt makes of the geometry of a link: a cylinder with two spheres at its ends is a capsule.
    fn shapes(&mut self, link: &LinkElement) -> Result<Vec<Shape>, String> {
        let (name, mut used) = (shown(&link.name), vec![false; link.collisions.len()]);
        let mut shapes = Vec::new();
        for (i, (pose, geometry)) in link.collisions.iter().enumerate() {
            let Geometry::Cylinder(radius, length) = geometry else { continue };
            let end = |sign: f64| pose * Point3::new(0.0, 0.0, sign * length / 2.0);
            let cap = |at: Point3<f64>| {
                link.collisions.iter().position(|(pose, geometry)| {
                    *geometry == Geometry::Sphere(*radius) && (pose.translation.vector - at.coords).norm() < SAME_M
                })
            };
            if let (Some(a), Some(b)) = (cap(end(-1.0)), cap(end(1.0))) {
                let (a, b) = (a.min(b), a.max(b));
                [i, a, b].into_iter().for_each(|k| used[k] = true);
                let at = |k: usize| link.collisions[k].0.translation.vector.into();
                shapes.push((i, Shape::Capsule { from_m: at(a), to_m: at(b), radius_m: *radius }));
            }
        }
        for (i, (pose, geometry)) in link.collisions.iter().enumerate().filter(|(i, _)| !used[*i]) {
            let shape = match geometry {
                Geometry::Box(size) => Shape::Box { pose: *pose, half_m: size.map(|s| s / 2.0) },
                Geometry::Sphere(radius) => {
                    let at = pose.translation.vector.into();
                    Shape::Capsule { from_m: at, to_m: at, radius_m: *radius }
                }
                Geometry::Cylinder(radius, length) => {
                    self.remarks.push(format!("a cylinder of link {name} becomes the box around it"));
                    Shape::Box { pose: *pose, half_m: [*radius, *radius, length / 2.0] }
                }
                Geometry::Mesh(file, scale) => {
                    let path = (self.mesh)(file).map_err(|why| format!("link \"{name}\": {why}"))?;
                    let (low, high) = bounds_of_stl(&path, *scale).map_err(|why| format!("link \"{name}\": {why}"))?;
                    self.remarks.push(format!("the mesh of link {name} becomes the box around it; [shapes] can say better"));
                    let middle: [f64; 3] = std::array::from_fn(|k| (low[k] + high[k]) / 2.0);
                    Shape::Box {
                        pose: pose * Translation3::from(middle),
                        half_m: std::array::from_fn(|k| (high[k] - low[k]) / 2.0),
                    }
                }
            };
            shapes.push((i, shape));
        }
        shapes.sort_by_key(|(i, _)| *i);
        Ok(shapes.into_iter().map(|(_, shape)| shape).collect())
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
        let mut links = vec![link(&bodies[0], true)?];
        for at in &order {
            links.push(link(&bodies[at + 1], false)?);
        }
        let hand = &description.hand;
        let ready: Vec<f64> = description.ready.iter().chain(&hand.opened).copied().collect();
        for (key, positions) in [("ready or hand.opened", ready.as_slice()), ("hand.closed", hand.closed.as_slice())] {
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
        let posture = description.posture.iter().map(|(name, position)| Posture {
            joint: description.arm.iter().position(|joint| joint == name).expect("checked"),
            position: *position,
        });
        let robot = Robot {
            name: description.name.clone(),
            links,
            joints: made,
            arm,
            tool_m: description.tool.xyz_m,
            tool_from_hand: isometry([0.0; 3], description.tool.rpy_rad).rotation.inverse(),
            ready,
            closed: hand.closed.clone(),
            finger_speed: hand.speed,
            posture: posture.collect(),
        };
        remarks.sort();
        remarks.dedup();
        Ok(Read { robot, remarks })
    }
}

fn own_shape(entry: &ShapeEntry) -> Shape {
    match *entry {
        ShapeEntry::Capsule { from_m, to_m, radius_m } => Shape::Capsule { from_m, to_m, radius_m },
        ShapeEntry::Box { center_m, half_m, rpy_rad } => Shape::Box { pose: isometry(center_m, rpy_rad), half_m },
    }
}

/// Mass and shapes of what moves together.
fn link(body: &Body, is_foot: bool) -> Result<Link, String> {
    let name = shown(&body.name);
    let mass_kg: f64 = body.masses.iter().map(|(_, mass, _)| mass).sum();
    let one = body.masses.len() == 1;
    if !is_foot && (mass_kg <= 0.0 || body.masses.is_empty()) {
        return Err(format!("link \"{name}\" moves, but has no mass: give it an <inertial> with mass and inertia"));
    }
    let com = match &body.masses[..] {
        [(com, ..)] => com.translation.vector,
        masses => {
            masses.iter().map(|(com, mass, _)| com.translation.vector * *mass).sum::<Vector3<f64>>()
                / mass_kg.max(f64::MIN_POSITIVE)
        }
    };
    let mut moments = Matrix3::zeros();
    for (at, mass, own) in &body.masses {
        let (turn, off) = (at.rotation.to_rotation_matrix(), at.translation.vector - com);
        let turned = if at.rotation.angle() < ALIGNED_RAD { *own } else { turn.matrix() * own * turn.matrix().transpose() };
        let shift = (Matrix3::identity() * off.norm_squared() - off * off.transpose()) * *mass;
        moments += if one { turned } else { turned + shift };
    }
    let diagonal = moments[(0, 1)] == 0.0 && moments[(0, 2)] == 0.0 && moments[(1, 2)] == 0.0;
    let (principal, axes) = if diagonal {
        (moments.diagonal(), UnitQuaternion::identity())
    } else {
        let eigen = moments.symmetric_eigen();
        let mut axes = eigen.eigenvectors;
        if axes.determinant() < 0.0 {
            axes.column_mut(2).neg_mut();
        }
        (eigen.eigenvalues, UnitQuaternion::from_matrix(&axes))
    };
    let [a, b, c] = [principal.x, principal.y, principal.z];
    if !is_foot && a.min(b).min(c) <= 0.0 {
        return Err(format!("link \"{name}\": moments of inertia {a:.3e}, {b:.3e}, {c:.3e} kg m^2; each must be above 0"));
    }
    let inertia = Inertia { mass_kg, com_m: com.into(), principal_kg_m2: principal.into(), axes };
    Ok(Link { name: body.name.clone(), inertia, shapes: body.shapes.clone() })
}
