//! A robot as a URDF document, as hilt has it: what is fixed is one link, joints act along the z axis of their links.
//!
//! Links and joints keep their names, so that a viewer can pose the model from recorded transforms or from recorded joint states. URDF knows no
//! capsule: one is a cylinder and two spheres.

use super::model::{Inertia, Joint, JointKind, Link, Robot, Shape};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

/// Name of the massless frame at the tool point, fixed to the hand.
pub const TOOL_FRAME: &str = "hilt_tool";
/// The line that such a document begins with.
pub const XML_LINE: &str = "<?xml version=\"1.0\"?>\n";
/// Colour of the robot, red green blue alpha in 0..=1.
const RGBA: &str = "0.36 0.39 0.45 1";
/// The robot's colour, by the name that its solids call it.
const ROBOT_MATERIAL: &str = "<material name=\"robot\"/>";

/// What a solid is; its middle is its origin, a cylinder stands along z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Geometry {
    /// Full edges x y z \[m\].
    Box([f64; 3]),
    /// \[m\].
    Cylinder {
        /// \[m\].
        radius_m: f64,
        /// \[m\].
        height_m: f64,
    },
    /// Radius \[m\].
    Ball(f64),
}

/// Something to look at, fixed to a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solid {
    /// Its origin in the frame \[m\].
    pub at_m: [f64; 3],
    /// What it is.
    pub geometry: Geometry,
    /// Red green blue alpha in 0..=1.
    pub rgba: [f64; 4],
}

/// A thing beside the robot that may move.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Its frame.
    pub frame: String,
    /// Where it is at first.
    pub pose: Isometry3<f64>,
    /// What it looks like, in its frame.
    pub solids: Vec<Solid>,
}

/// A robot and what is around it, to be looked at: no inertia, no collision geometry. The first link is `world`, which holds `fixed` and the foot; a body
/// is a link of its own, floating.
pub fn scene_urdf(robot: &Robot, world: &str, fixed: &[Solid], bodies: &[Body]) -> String {
    let mut xml = begin(robot);
    let link = |name: &str, solids: &[Solid]| {
        let shown: String = solids.iter().map(coloured).collect();
        format!("  <link name=\"{}\">\n{shown}  </link>\n", escaped(name))
    };
    xml += &link(world, fixed);
    for Link { name, shapes, .. } in &robot.links {
        let shown: String = shapes.iter().flat_map(solids).map(|solid| visual(&solid, ROBOT_MATERIAL)).collect();
        xml += &format!("  <link name=\"{}\">\n{shown}  </link>\n", escaped(name));
    }
    let foot = escaped(&robot.links[0].name);
    xml += &rigid_joint(&format!("{}_on_{}", foot, escaped(world)), "fixed", &Isometry3::identity(), &escaped(world), &foot);
    let links = robot.links.iter().map(|link| escaped(&link.name)).collect::<Vec<_>>();
    robot.joints.iter().enumerate().for_each(|(i, joint)| xml += &joint_element(joint, &links[joint.parent], &links[i + 1]));
    for Body { frame, pose, solids } in bodies {
        xml += &link(frame, solids);
        xml += &rigid_joint(&escaped(frame), "floating", pose, &escaped(world), &escaped(frame));
    }
    xml + "</robot>\n"
}

fn begin(robot: &Robot) -> String {
    let name = escaped(&robot.name);
    format!("{XML_LINE}<robot name=\"{name}\">\n  <material name=\"robot\"><color rgba=\"{RGBA}\"/></material>\n")
}

/// The document: links with inertia, visual and collision geometry, joints (`continuous` where nothing stops them) along their local z axis, and
/// the tool's frame. Lengths in m, angles in rad, masses in kg.
pub fn urdf(robot: &Robot) -> String {
    let mut xml = begin(robot);
    robot.links.iter().for_each(|link| xml += &link_element(&link.name, &link.inertia, &link.shapes));
    let links = robot.links.iter().map(|link| escaped(&link.name)).collect::<Vec<_>>();
    robot.joints.iter().enumerate().for_each(|(i, joint)| xml += &joint_element(joint, &links[joint.parent], &links[i + 1]));
    let tool = Isometry3::from_parts(robot.tool_m.into(), robot.tool_from_hand.inverse());
    xml += &format!("  <link name=\"{TOOL_FRAME}\"/>\n");
    xml += &rigid_joint(TOOL_FRAME, "fixed", &tool, &links[robot.hand()], TOOL_FRAME);
    xml + "</robot>\n"
}

/// A joint without an axis; its names are escaped.
fn rigid_joint(name: &str, kind: &str, at: &Isometry3<f64>, parent: &str, child: &str) -> String {
    let xml = format!("  <joint name=\"{name}\" type=\"{kind}\">\n");
    xml + &format!("    {}\n    <parent link=\"{parent}\"/>\n    <child link=\"{child}\"/>\n  </joint>\n", origin(at))
}

fn visual(solid: &str, material: &str) -> String {
    format!("    <visual>\n{solid}      {material}\n    </visual>\n")
}

/// The visual of a solid with a colour of its own.
fn coloured(Solid { at_m, geometry, rgba }: &Solid) -> String {
    let geometry = match geometry {
        Geometry::Box([x, y, z]) => format!("<box size=\"{x} {y} {z}\"/>"),
        Geometry::Cylinder { radius_m, height_m } => format!("<cylinder radius=\"{radius_m}\" length=\"{height_m}\"/>"),
        Geometry::Ball(radius_m) => format!("<sphere radius=\"{radius_m}\"/>"),
    };
    let [name, rgba] = ["_", " "].map(|between| rgba.map(|c| c.to_string()).join(between));
    let material = format!("<material name=\"rgba_{name}\"><color rgba=\"{rgba}\"/></material>");
    visual(&solid(&placed(*at_m, UnitQuaternion::identity()), &geometry), &material)
}

fn link_element(name: &str, inertia: &Inertia, shapes: &[Shape]) -> String {
    let Inertia { mass_kg, com_m, principal_kg_m2: [ixx, iyy, izz], axes } = *inertia;
    let mut xml = format!("  <link name=\"{}\">\n", escaped(name));
    if mass_kg > 0.0 {
        xml += &format!("    <inertial>\n      {}\n      <mass value=\"{mass_kg}\"/>\n", placed(com_m, axes));
        xml += &format!(
            "      <inertia ixx=\"{ixx}\" ixy=\"0\" ixz=\"0\" iyy=\"{iyy}\" iyz=\"0\" izz=\"{izz}\"/>\n    </inertial>\n"
        );
    }
    let solids: Vec<String> = shapes.iter().flat_map(solids).collect();
    solids.iter().for_each(|solid| xml += &visual(solid, ROBOT_MATERIAL));
    for solid in &solids {
        xml += &format!("    <collision>\n{solid}    </collision>\n");
    }
    xml + "  </link>\n"
}

fn joint_element(joint: &Joint, parent: &str, child: &str) -> String {
    let [low, high] = joint.limits;
    let kind = match joint.kind {
        JointKind::Prismatic => "prismatic",
        JointKind::Revolute if joint.continuous => "continuous",
        JointKind::Revolute => "revolute",
    };
    let range = if joint.continuous { String::new() } else { format!("lower=\"{low}\" upper=\"{high}\" ") };
    let (effort, velocity) = (joint.effort, joint.velocity);
    let mut xml = format!("  <joint name=\"{}\" type=\"{kind}\">\n", escaped(&joint.name));
    xml += &format!("    {}\n    <parent link=\"{parent}\"/>\n", origin(&joint.origin));
    xml += &format!("    <child link=\"{child}\"/>\n    <axis xyz=\"0 0 1\"/>\n");
    xml + &format!("    <limit {range}effort=\"{effort}\" velocity=\"{velocity}\"/>\n  </joint>\n")
}

/// The geometry of a shape: elements between `<visual>` or `<collision>` and what follows.
fn solids(shape: &Shape) -> Vec<String> {
    match *shape {
        Shape::Box { pose, half_m } => {
            let [x, y, z] = half_m.map(|h| 2.0 * h);
            vec![solid(&origin(&pose), &format!("<box size=\"{x} {y} {z}\"/>"))]
        }
        Shape::Capsule { from_m, to_m, radius_m } => {
            let (from, to) = (Vector3::from(from_m), Vector3::from(to_m));
            let axis = to - from;
            let turn = UnitQuaternion::rotation_between(&Vector3::z(), &axis)
                .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
            let sphere = format!("<sphere radius=\"{radius_m}\"/>");
            let ball = |at: [f64; 3]| solid(&placed(at, UnitQuaternion::identity()), &sphere);
            if axis.norm() == 0.0 {
                return vec![ball(from_m)];
            }
            let cylinder = format!("<cylinder radius=\"{radius_m}\" length=\"{}\"/>", axis.norm());
            vec![solid(&placed(((from + to) / 2.0).into(), turn), &cylinder), ball(from_m), ball(to_m)]
        }
    }
}

fn solid(origin: &str, geometry: &str) -> String {
    format!("      {origin}\n      <geometry>{geometry}</geometry>\n")
}

fn origin(at: &Isometry3<f64>) -> String {
    placed(at.translation.vector.into(), at.rotation)
}

fn placed(xyz_m: [f64; 3], turn: UnitQuaternion<f64>) -> String {
    let (roll, pitch, yaw) = turn.euler_angles();
    let words = |v: [f64; 3]| v.map(|x| x.to_string()).join(" ");
    format!("<origin xyz=\"{}\" rpy=\"{}\"/>", words(xyz_m), words([roll, pitch, yaw]))
}

/// A name within quotes.
fn escaped(name: &str) -> String {
    name.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}
