//! The URDF document, read back with an XML parser, describes the arm that the library computes with.

use hilt::robot::jaco::{LINK_INERTIA, LINK_NAMES, LINK_SHAPES, LINKS};
use hilt::robot::urdf::TOOL_FRAME;
use hilt::robot::{Arm, POSITION_LIMITS_RAD, Shape, VELOCITY_LIMITS_RAD_S, urdf};
use hilt::state::{JOINT_NAMES, JOINTS};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use roxmltree::{Document, Node};

fn child<'a, 'input>(node: Node<'a, 'input>, name: &str) -> Node<'a, 'input> {
    node.children().find(|c| c.has_tag_name(name)).unwrap_or_else(|| panic!("no <{name}> in {:?}", node.attribute("name")))
}

fn number(node: Node, name: &str) -> f64 {
    node.attribute(name).unwrap_or_else(|| panic!("no {name}")).parse().unwrap()
}

fn triple(node: Node, name: &str) -> Vector3<f64> {
    let numbers = node.attribute(name).unwrap().split_whitespace().map(|w| w.parse().unwrap());
    Vector3::from_iterator(numbers)
}

fn origin(node: Node) -> Isometry3<f64> {
    let origin = child(node, "origin");
    let rpy = triple(origin, "rpy");
    Isometry3::from_parts(Translation3::from(triple(origin, "xyz")), UnitQuaternion::from_euler_angles(rpy.x, rpy.y, rpy.z))
}

fn link_of<'a>(joint: Node<'a, '_>, end: &str) -> &'a str {
    child(joint, end).attribute("link").unwrap()
}

fn joints<'a, 'input>(document: &'a Document<'input>) -> Vec<Node<'a, 'input>> {
    document.root_element().children().filter(|c| c.has_tag_name("joint")).collect()
}

#[test]
fn the_parsed_chain_has_the_arms_kinematics() {
    let text = urdf();
    let document = Document::parse(&text).unwrap();
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(7);
    for _ in 0..50 {
        let q: [f64; JOINTS] = std::array::from_fn(|i| {
            let [low, high] = POSITION_LIMITS_RAD[i];
            low + (high - low) * rng.random::<f64>()
        });
        let mut poses = vec![(LINK_NAMES[0], Isometry3::identity())];
        for joint in joints(&document) {
            let parent = poses.iter().find(|(name, _)| *name == link_of(joint, "parent")).expect("parents come first").1;
            let turn = match joint.attribute("type").unwrap() {
                "fixed" => UnitQuaternion::identity(),
                _ => {
                    let i = JOINT_NAMES.iter().position(|n| joint.attribute("name") == Some(n)).unwrap();
                    UnitQuaternion::from_scaled_axis(triple(child(joint, "axis"), "xyz") * q[i])
                }
            };
            poses.push((link_of(joint, "child"), parent * origin(joint) * turn));
        }
        let expected = Arm::new().link_poses(&q);
        for (link, name) in LINK_NAMES.iter().enumerate() {
            let pose = poses.iter().find(|(n, _)| n == name).unwrap().1;
            let difference = pose.to_homogeneous() - expected[link].to_homogeneous();
            assert!(difference.amax() < 1e-12, "{name} at {q:?}: {difference}");
        }
        let tool = poses.iter().find(|(n, _)| *n == TOOL_FRAME).unwrap().1;
        assert!((tool.translation.vector - Arm::new().tool_pose(&q).translation.vector).norm() < 1e-12);
    }
}

#[test]
fn limits_inertia_and_geometry_are_the_constants() {
    let text = urdf();
    let document = Document::parse(&text).unwrap();
    for (i, name) in JOINT_NAMES.iter().enumerate() {
        let joint = *joints(&document).iter().find(|j| j.attribute("name") == Some(name)).unwrap();
        let limit = child(joint, "limit");
        assert_eq!(number(limit, "velocity"), VELOCITY_LIMITS_RAD_S[i]);
        let free = [0, 3, 4, 5].contains(&i);
        assert_eq!(joint.attribute("type"), Some(if free { "continuous" } else { "revolute" }), "{name}");
        if !free {
            assert_eq!([number(limit, "lower"), number(limit, "upper")], POSITION_LIMITS_RAD[i]);
        }
    }
    let links: Vec<Node> = document.root_element().children().filter(|c| c.has_tag_name("link")).collect();
    assert_eq!(links.len(), LINKS + 1, "ten links and the tool frame");
    for (i, link) in links[..LINKS].iter().enumerate() {
        assert_eq!(link.attribute("name"), Some(LINK_NAMES[i]));
        assert_eq!(number(child(child(*link, "inertial"), "mass"), "value"), LINK_INERTIA[i].mass_kg);
        let count = |kind| link.children().filter(|c| c.has_tag_name(kind)).count();
        let capsules = LINK_SHAPES.iter().filter(|s| s.link == i && matches!(s.shape, Shape::Capsule { .. })).count();
        let boxes = LINK_SHAPES.iter().filter(|s| s.link == i).count() - capsules;
        assert_eq!((count("visual"), count("collision")), (3 * capsules + boxes, 3 * capsules + boxes));
    }
}

#[test]
fn a_capsules_cylinder_ends_in_its_spheres() {
    let text = urdf();
    let document = Document::parse(&text).unwrap();
    let mut seen = 0;
    for link in document.root_element().children().filter(|c| c.has_tag_name("link")) {
        let parts: Vec<Node> = link.children().filter(|c| c.has_tag_name("collision")).collect();
        for part in &parts {
            let Some(cylinder) = child(*part, "geometry").children().find(|c| c.has_tag_name("cylinder")) else { continue };
            for sign in [-1.0, 1.0] {
                let end = origin(*part) * Point3::new(0.0, 0.0, sign * number(cylinder, "length") / 2.0);
                let at_end = |p: &&Node| {
                    let ball = child(**p, "geometry").children().any(|c| c.has_tag_name("sphere"));
                    ball && (origin(**p).translation.vector - end.coords).norm() < 1e-9
                };
                assert_eq!(parts.iter().filter(at_end).count(), 1, "{:?}", link.attribute("name"));
            }
            seen += 1;
        }
    }
    assert_eq!(seen, LINK_SHAPES.iter().filter(|s| matches!(s.shape, Shape::Capsule { .. })).count());
}
