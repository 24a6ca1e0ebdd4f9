//! The URDF document, read back with an XML parser, describes the robot that the library computes with.

use hilt::joints::Joints;
use hilt::robot::file::built_in::{named, names};
use hilt::robot::model::{JointKind, Shape};
use hilt::robot::{Robot, TOOL_FRAME, urdf};
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

fn robots() -> impl Iterator<Item = Robot> {
    names().into_iter().map(|name| named(name).expect("it is there").expect("it is sound"))
}

#[test]
fn the_parsed_chain_has_the_robots_kinematics() {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(7);
    for robot in robots() {
        let text = urdf(&robot);
        let document = Document::parse(&text).unwrap();
        for _ in 0..50 {
            let within = |i: usize, share: f64| robot.joints[i].limits[0] * (1.0 - share) + robot.joints[i].limits[1] * share;
            let q = Joints::from_fn(robot.joints.len(), |i| within(i, rng.random::<f64>()));
            let mut poses = vec![(robot.links[0].name.as_str(), Isometry3::identity())];
            for joint in joints(&document) {
                let parent = poses.iter().find(|(name, _)| *name == link_of(joint, "parent")).expect("parents come first").1;
                let place = || robot.joints.iter().position(|j| joint.attribute("name") == Some(&j.name)).unwrap();
                let along = || triple(child(joint, "axis"), "xyz") * q[place()];
                let motion: Isometry3<f64> = match joint.attribute("type").unwrap() {
                    "fixed" => Isometry3::identity(),
                    "prismatic" => Translation3::from(along()).into(),
                    _ => Isometry3::rotation(along()),
                };
                poses.push((link_of(joint, "child"), parent * origin(joint) * motion));
            }
            let expected = robot.link_poses(&q);
            for (link, pose) in robot.links.iter().zip(&expected) {
                let parsed = poses.iter().find(|(n, _)| *n == link.name).unwrap().1;
                let difference = parsed.to_homogeneous() - pose.to_homogeneous();
                assert!(difference.amax() < 1e-12, "{} at {q:?}: {difference}", link.name);
            }
            let tool = poses.iter().find(|(n, _)| *n == TOOL_FRAME).unwrap().1;
            assert!((tool.to_homogeneous() - robot.tool_pose(&q).to_homogeneous()).amax() < 1e-12);
        }
    }
}

#[test]
fn limits_inertia_and_geometry_are_the_robots() {
    for robot in robots() {
        let text = urdf(&robot);
        let document = Document::parse(&text).unwrap();
        for ours in &robot.joints {
            let joint = *joints(&document).iter().find(|j| j.attribute("name") == Some(&ours.name)).unwrap();
            let limit = child(joint, "limit");
            assert_eq!((number(limit, "velocity"), number(limit, "effort")), (ours.velocity, ours.effort));
            let kind = if ours.continuous { "continuous" } else { "revolute" };
            let kind = if ours.kind == JointKind::Prismatic { "prismatic" } else { kind };
            assert_eq!(joint.attribute("type"), Some(kind), "{}", ours.name);
            if !ours.continuous {
                assert_eq!([number(limit, "lower"), number(limit, "upper")], ours.limits);
            }
        }
        let links: Vec<Node> = document.root_element().children().filter(|c| c.has_tag_name("link")).collect();
        assert_eq!(links.len(), robot.links.len() + 1, "its links and the tool frame");
        for (link, ours) in links.iter().zip(&robot.links) {
            assert_eq!(link.attribute("name"), Some(ours.name.as_str()));
            if ours.inertia.mass_kg > 0.0 {
                assert_eq!(number(child(child(*link, "inertial"), "mass"), "value"), ours.inertia.mass_kg);
            }
            let count = |kind| link.children().filter(|c| c.has_tag_name(kind)).count();
            // A capsule is a cylinder and two spheres, or one sphere.
            let solids = |shape: &Shape| match shape {
                Shape::Capsule { from_m, to_m, .. } if from_m != to_m => 3,
                _ => 1,
            };
            let solids: usize = ours.shapes.iter().map(solids).sum();
            assert_eq!((count("visual"), count("collision")), (solids, solids));
        }
    }
}

#[test]
fn a_capsules_cylinder_ends_in_its_spheres() {
    for robot in robots() {
        let text = urdf(&robot);
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
        let capsule = |shape: &&Shape| matches!(shape, Shape::Capsule { from_m, to_m, .. } if from_m != to_m);
        assert_eq!(seen, robot.links.iter().flat_map(|link| &link.shapes).filter(capsule).count());
    }
}
