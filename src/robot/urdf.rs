//! The arm as a URDF document, written from the same constants that planning, simulation and pictures use.
//!
//! Links carry [`LINK_NAMES`] (the `child_frame_id` of recorded transforms) and joints carry [`JOINT_NAMES`] unchanged (the names in
//! recorded joint states), so a viewer can pose the model from either. URDF knows no capsule: one is a cylinder and two spheres.

use super::jaco::{
    HAND_LINK, JOINT_SPECS, LINK_INERTIA, LINK_NAMES, LINK_SHAPES, LINKS, LinkInertia, POSITION_LIMITS_RAD, Shape,
    TOOL_IN_HAND_M, TORQUE_LIMITS_N_M, VELOCITY_LIMITS_RAD_S,
};
use crate::state::{JOINT_NAMES, JOINTS};
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::TAU;

/// Name of the robot in the document.
pub const ROBOT_NAME: &str = "j2n6s300";
/// Name of the massless frame at the tool point, fixed to the hand.
pub const TOOL_FRAME: &str = "j2n6s300_end_effector";
/// Name of the fixed joint that carries [`TOOL_FRAME`].
pub const TOOL_JOINT: &str = "end_effector";
/// Colour of the arm, red green blue alpha in 0..=1.
const ARM_RGBA: &str = "0.36 0.39 0.45 1";

/// The document: ten links with inertia, visual and collision geometry, nine joints (`continuous` where the arm turns freely,
/// else `revolute`) about their local z axis, and the tool frame. Lengths in m, angles in rad, masses in kg. Pure function of the
/// constants in [`super::jaco`].
pub fn urdf() -> String {
    let mut xml = format!("<?xml version=\"1.0\"?>\n<robot name=\"{ROBOT_NAME}\">\n");
    xml += &format!("  <material name=\"arm\"><color rgba=\"{ARM_RGBA}\"/></material>\n");
    (0..LINKS).for_each(|link| xml += &link_element(link));
    (0..JOINTS).for_each(|joint| xml += &joint_element(joint));
    xml += &format!("  <link name=\"{TOOL_FRAME}\"/>\n  <joint name=\"{TOOL_JOINT}\" type=\"fixed\">\n");
    xml += &format!("    {}\n", origin(TOOL_IN_HAND_M, [0.0; 3]));
    xml += &format!("    <parent link=\"{}\"/>\n    <child link=\"{TOOL_FRAME}\"/>\n  </joint>\n", LINK_NAMES[HAND_LINK]);
    xml + "</robot>\n"
}

fn link_element(link: usize) -> String {
    let LinkInertia { mass_kg, com_m, inertia_kg_m2: [ixx, iyy, izz] } = LINK_INERTIA[link];
    let mut xml = format!("  <link name=\"{}\">\n    <inertial>\n      {}\n", LINK_NAMES[link], origin(com_m, [0.0; 3]));
    xml +=
        &format!("      <mass value=\"{mass_kg}\"/>\n      <inertia ixx=\"{ixx}\" ixy=\"0\" ixz=\"0\" iyy=\"{iyy}\" iyz=\"0\" ");
    xml += &format!("izz=\"{izz}\"/>\n    </inertial>\n");
    let solids: Vec<String> = LINK_SHAPES.iter().filter(|s| s.link == link).flat_map(|s| solids(&s.shape)).collect();
    for solid in &solids {
        xml += &format!("    <visual>\n{solid}      <material name=\"arm\"/>\n    </visual>\n");
    }
    for solid in &solids {
        xml += &format!("    <collision>\n{solid}    </collision>\n");
    }
    xml + "  </link>\n"
}

fn joint_element(joint: usize) -> String {
    let spec = &JOINT_SPECS[joint];
    let [low, high] = POSITION_LIMITS_RAD[joint];
    let free = high - low > TAU;
    let kind = if free { "continuous" } else { "revolute" };
    let range = if free { String::new() } else { format!("lower=\"{low}\" upper=\"{high}\" ") };
    let (effort, velocity) = (TORQUE_LIMITS_N_M[joint], VELOCITY_LIMITS_RAD_S[joint]);
    let mut xml = format!("  <joint name=\"{}\" type=\"{kind}\">\n", JOINT_NAMES[joint]);
    xml += &format!("    {}\n    <parent link=\"{}\"/>\n", origin(spec.xyz_m, spec.rpy_rad), LINK_NAMES[spec.parent]);
    xml += &format!("    <child link=\"{}\"/>\n    <axis xyz=\"0 0 1\"/>\n", LINK_NAMES[joint + 1]);
    xml + &format!("    <limit {range}effort=\"{effort}\" velocity=\"{velocity}\"/>\n  </joint>\n")
}

/// `<origin>` and `<geometry>` of each solid that makes up a shape.
fn solids(shape: &Shape) -> Vec<String> {
    match *shape {
        Shape::Box { center_m, half_m: [x, y, z] } => {
            vec![solid(center_m, [0.0; 3], &format!("<box size=\"{} {} {}\"/>", 2.0 * x, 2.0 * y, 2.0 * z))]
        }
        Shape::Capsule { from_m, to_m, radius_m } => {
            let (from, to) = (Vector3::from(from_m), Vector3::from(to_m));
            let axis = to - from;
            // A half turn (axis along -z) has no unique shortest rotation; a cylinder looks the same either way round.
            let turn = UnitQuaternion::rotation_between(&Vector3::z(), &axis).unwrap_or_default();
            let (roll, pitch, yaw) = turn.euler_angles();
            let cylinder = format!("<cylinder radius=\"{radius_m}\" length=\"{}\"/>", axis.norm());
            let sphere = format!("<sphere radius=\"{radius_m}\"/>");
            let middle = (from + to) / 2.0;
            vec![
                solid(middle.into(), [roll, pitch, yaw], &cylinder),
                solid(from_m, [0.0; 3], &sphere),
                solid(to_m, [0.0; 3], &sphere),
            ]
        }
    }
}

fn solid(xyz_m: [f64; 3], rpy_rad: [f64; 3], geometry: &str) -> String {
    format!("      {}\n      <geometry>{geometry}</geometry>\n", origin(xyz_m, rpy_rad))
}

fn origin(xyz_m: [f64; 3], rpy_rad: [f64; 3]) -> String {
    let words = |v: [f64; 3]| v.map(|x| x.to_string()).join(" ");
    format!("<origin xyz=\"{}\" rpy=\"{}\"/>", words(xyz_m), words(rpy_rad))
}
