//! A URDF document as it stands: links, joints, and where in the file they are.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use roxmltree::{Document, Node};
use std::str::FromStr;

/// Longest document that is read \[bytes\]: a robot with hundreds of links has a tenth of it.
pub const LONGEST_FILE: u64 = 4 << 20;
/// Most elements and texts of a document.
const MOST_NODES: u32 = 200_000;

/// A document.
#[derive(Debug, Default)]
pub struct Urdf {
    /// Links.
    pub links: Vec<LinkElement>,
    /// Joints.
    pub joints: Vec<JointElement>,
}

/// `<link>`.
#[derive(Debug)]
pub struct LinkElement {
    /// Name.
    pub name: String,
    /// Line of the file.
    pub line: u32,
    /// `<inertial>`: where it is, mass \[kg\], and ixx iyy izz ixy ixz iyz \[kg m^2\].
    pub inertial: Option<(Isometry3<f64>, f64, [f64; 6])>,
    /// `<collision>`.
    pub collisions: Vec<(Isometry3<f64>, Geometry)>,
}

/// `<geometry>`.
#[derive(Clone, Debug, PartialEq)]
pub enum Geometry {
    /// Edges \[m\].
    Box([f64; 3]),
    /// Along z: radius and length \[m\].
    Cylinder(f64, f64),
    /// Radius \[m\].
    Sphere(f64),
    /// File name and scale.
    Mesh(String, [f64; 3]),
}

/// `<joint>`.
#[derive(Debug)]
pub struct JointElement {
    /// Name.
    pub name: String,
    /// Line of the file.
    pub line: u32,
    /// `type`.
    pub kind: String,
    /// `parent_from_joint`.
    pub origin: Isometry3<f64>,
    /// Names of the links.
    pub parent: String,
    /// The same.
    pub child: String,
    /// Unit vector or not: as it stands.
    pub axis: [f64; 3],
    /// Lower and upper limit, where there are both.
    pub range: Option<[f64; 2]>,
    /// `velocity` of `<limit>`.
    pub velocity: Option<f64>,
    /// `effort` of `<limit>`.
    pub effort: Option<f64>,
    /// `damping` and `friction` of `<dynamics>`.
    pub dynamics: [Option<f64>; 2],
    /// The joint that it mimics.
    pub mimics: Option<String>,
}

/// Reads a document. A document type is refused, and with it entities that grow when they are expanded.
///
/// # Errors
/// Says what is wrong, and in which line.
pub fn read(text: &str) -> Result<Urdf, String> {
    let options = roxmltree::ParsingOptions { allow_dtd: false, nodes_limit: MOST_NODES, ..Default::default() };
    let document = Document::parse_with_options(text, options).map_err(|e| format!("not a readable XML document: {e}"))?;
    let root = document.root_element();
    if root.tag_name().name() != "robot" {
        return Err(format!(
            "its outermost element is <{}>; a URDF has <robot> (xacro must be expanded first)",
            root.tag_name().name()
        ));
    }
    let mut urdf = Urdf::default();
    for node in root.children().filter(Node::is_element) {
        match node.tag_name().name() {
            "link" => urdf.links.push(link(node)?),
            "joint" => urdf.joints.push(joint(node)?),
            name if node.tag_name().namespace().is_some_and(|n| n.contains("xacro")) => {
                return Err(at(node, &format!("<xacro:{name}>: expand the document first, with `xacro FILE > FILE.urdf`")));
            }
            _ => {}
        }
    }
    Ok(urdf)
}

fn link(node: Node) -> Result<LinkElement, String> {
    let name = text(node, "name")?;
    let inertial = child(node, "inertial").map(|inertial| {
        let mass = number(needed(inertial, "mass")?, "value")?;
        let inertia = needed(inertial, "inertia")?;
        let mut moments = [0.0; 6];
        for (slot, key) in moments.iter_mut().zip(["ixx", "iyy", "izz", "ixy", "ixz", "iyz"]) {
            *slot = if inertia.has_attribute(key) { number(inertia, key)? } else { 0.0 };
        }
        Ok::<_, String>((origin(inertial)?, mass, moments))
    });
    let collisions = node.children().filter(|c| c.has_tag_name("collision"));
    let collisions = collisions.map(|c| Ok((origin(c)?, geometry(needed(c, "geometry")?)?)));
    Ok(LinkElement {
        name,
        line: line(node),
        inertial: inertial.transpose()?,
        collisions: collisions.collect::<Result<_, String>>()?,
    })
}

fn geometry(node: Node) -> Result<Geometry, String> {
    let Some(shape) = node.children().find(Node::is_element) else { return Err(at(node, "an empty <geometry>")) };
    match shape.tag_name().name() {
        "box" => Ok(Geometry::Box(positive(shape, "size", numbers(shape, "size")?)?)),
        "cylinder" => {
            let [radius, length] = [number(shape, "radius")?, number(shape, "length")?];
            let [radius, length] = positive(shape, "radius, length", [radius, length])?;
            Ok(Geometry::Cylinder(radius, length))
        }
        "sphere" => Ok(Geometry::Sphere(positive(shape, "radius", [number(shape, "radius")?])?[0])),
        "mesh" => {
            let scale = if shape.has_attribute("scale") { numbers(shape, "scale")? } else { [1.0; 3] };
            Ok(Geometry::Mesh(text(shape, "filename")?, scale))
        }
        other => Err(at(shape, &format!("<{other}>; allowed: box, cylinder, sphere, mesh"))),
    }
}

fn joint(node: Node) -> Result<JointElement, String> {
    let limit = child(node, "limit");
    let optional = |from: Option<Node>, key: &str| match from {
        Some(node) if node.has_attribute(key) => number(node, key).map(Some),
        _ => Ok(None),
    };
    let dynamics = child(node, "dynamics");
    let range = optional(limit, "lower")?.zip(optional(limit, "upper")?);
    Ok(JointElement {
        name: text(node, "name")?,
        line: line(node),
        kind: text(node, "type")?,
        origin: origin(node)?,
        parent: text(needed(node, "parent")?, "link")?,
        child: text(needed(node, "child")?, "link")?,
        axis: child(node, "axis").map_or(Ok([1.0, 0.0, 0.0]), |axis| numbers(axis, "xyz"))?,
        range: range.map(|(lower, upper)| [lower, upper]),
        velocity: optional(limit, "velocity")?,
        effort: optional(limit, "effort")?,
        dynamics: [optional(dynamics, "damping")?, optional(dynamics, "friction")?],
        mimics: child(node, "mimic").map(|mimic| text(mimic, "joint")).transpose()?,
    })
}

fn origin(node: Node) -> Result<Isometry3<f64>, String> {
    let Some(origin) = child(node, "origin") else { return Ok(Isometry3::identity()) };
    let of = |key: &str| if origin.has_attribute(key) { numbers(origin, key) } else { Ok([0.0; 3]) };
    Ok(isometry(of("xyz")?, of("rpy")?))
}

/// Translation \[m\], then roll, pitch and yaw \[rad\].
pub fn isometry(xyz_m: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::from(xyz_m), UnitQuaternion::from_euler_angles(roll, pitch, yaw))
}

fn child<'a, 'input>(node: Node<'a, 'input>, name: &str) -> Option<Node<'a, 'input>> {
    node.children().find(|c| c.has_tag_name(name))
}

fn needed<'a, 'input>(node: Node<'a, 'input>, name: &str) -> Result<Node<'a, 'input>, String> {
    child(node, name).ok_or_else(|| at(node, &format!("no <{name}>")))
}

fn text(node: Node, key: &str) -> Result<String, String> {
    let value = node.attribute(key).map(str::trim).filter(|value| !value.is_empty());
    value.map(String::from).ok_or_else(|| at(node, &format!("no {key}")))
}

fn number(node: Node, key: &str) -> Result<f64, String> {
    finite(node, key, &text(node, key)?)
}

fn numbers<const N: usize>(node: Node, key: &str) -> Result<[f64; N], String> {
    let words = text(node, key)?;
    let found = words.split_whitespace().map(|word| finite(node, key, word)).collect::<Result<Vec<_>, _>>()?;
    let count = found.len();
    found.try_into().map_err(|_| at(node, &format!("{key} has {count} numbers, {N} are needed")))
}

fn finite(node: Node, key: &str, word: &str) -> Result<f64, String> {
    let value = f64::from_str(word).ok().filter(|value| value.is_finite());
    value.ok_or_else(|| at(node, &format!("{key} is \"{}\", a finite number is needed", crate::words::shown(word))))
}

fn positive<const N: usize>(node: Node, key: &str, values: [f64; N]) -> Result<[f64; N], String> {
    match values.iter().find(|value| **value <= 0.0) {
        Some(value) => Err(at(node, &format!("{key} is {value}; it must be above 0"))),
        None => Ok(values),
    }
}

fn line(node: Node) -> u32 {
    node.document().text_pos_at(node.range().start).row
}

/// What is wrong with an element, after its place.
fn at(node: Node, what: &str) -> String {
    let name = node.attribute("name").map(|name| format!(" \"{}\"", crate::words::shown(name))).unwrap_or_default();
    format!("line {}, <{}>{name}: {what}", line(node), node.tag_name().name())
}
