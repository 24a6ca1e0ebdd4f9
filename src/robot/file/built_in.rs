//! The robots that come with hilt: the files of `pipelines/robots`, as they were when it was built.

use super::assemble::assemble;
use super::description::Description;
use super::xml;
use crate::robot::model::Robot;
use std::sync::{Arc, LazyLock};

/// Name, TOML and URDF of each.
const FILES: [(&str, &str, &str); 2] = [
    ("jaco", include_str!("../../../pipelines/robots/jaco.toml"), include_str!("../../../pipelines/robots/jaco.urdf")),
    ("panda", include_str!("../../../pipelines/robots/panda.toml"), include_str!("../../../pipelines/robots/panda.urdf")),
];

static JACO: LazyLock<Arc<Robot>> =
    LazyLock::new(|| Arc::new(named("jaco").expect("it is there").expect("its files are tested")));

/// The Kinova Jaco j2n6s300.
pub fn jaco() -> Arc<Robot> {
    Arc::clone(&JACO)
}

/// Names of all.
pub fn names() -> [&'static str; FILES.len()] {
    FILES.map(|(name, ..)| name)
}

/// The one of this name; `None` when there is none.
///
/// # Errors
/// What is wrong with its files.
pub fn named(name: &str) -> Option<Result<Robot, String>> {
    let (_, description, urdf) = FILES.iter().find(|(known, ..)| *known == name)?;
    let read = || {
        let (description, document) = (Description::parse(description)?, xml::read(urdf)?);
        assemble(&description, &document, &|mesh| Err(format!("{mesh}: a built-in robot has no meshes"))).map(|read| read.robot)
    };
    Some(read())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::jaco::*;
    use crate::robot::{Arm, Shape};
    use crate::state::{ARM_JOINTS, JOINT_NAMES, JOINTS};

    #[test]
    fn every_built_in_robot_is_sound() {
        for name in names() {
            let robot = named(name).expect("it is there").expect("its files are sound");
            assert_eq!(robot.name, name);
        }
        assert!(named("puma").is_none());
    }

    #[test]
    fn the_jacos_files_say_what_its_constants_say() {
        let robot = jaco();
        assert_eq!((robot.arm, robot.hand(), robot.joints.len(), robot.links.len()), (ARM_JOINTS, HAND_LINK, JOINTS, LINKS));
        assert_eq!((robot.tool_m, robot.ready.as_slice(), robot.finger_speed), (TOOL_IN_HAND_M, READY_Q_RAD.as_slice(), 0.8));
        for (i, joint) in robot.joints.iter().enumerate() {
            assert_eq!(
                (joint.name.as_str(), joint.parent, joint.limits),
                (JOINT_NAMES[i], JOINT_SPECS[i].parent, POSITION_LIMITS_RAD[i])
            );
            assert_eq!(
                (joint.velocity, joint.effort, &joint.origin),
                (VELOCITY_LIMITS_RAD_S[i], TORQUE_LIMITS_N_M[i], Arm::new().origin(i))
            );
        }
        for (i, link) in robot.links.iter().enumerate() {
            let LinkInertia { mass_kg, com_m, inertia_kg_m2 } = LINK_INERTIA[i];
            assert_eq!((link.name.as_str(), link.inertia.mass_kg, link.inertia.com_m), (LINK_NAMES[i], mass_kg, com_m));
            assert_eq!((link.inertia.principal_kg_m2, link.inertia.axes.angle()), (inertia_kg_m2, 0.0));
            let ours: Vec<_> = LINK_SHAPES.iter().filter(|s| s.link == i).map(|s| s.shape).collect();
            assert_eq!(link.shapes.len(), ours.len(), "{}", link.name);
            for (read, ours) in link.shapes.iter().zip(ours) {
                let expected = match ours {
                    Shape::Capsule { from_m, to_m, radius_m } => crate::robot::model::Shape::Capsule { from_m, to_m, radius_m },
                    Shape::Box { center_m, half_m } => crate::robot::model::Shape::cuboid(center_m, half_m),
                };
                assert_eq!(*read, expected, "{}", link.name);
            }
        }
        let q = READY_Q_RAD.map(|v| v + 0.2);
        assert_eq!(robot.link_poses(&q), Arm::new().link_poses(&q));
        let ((tool, jacobian), (theirs, expected)) = (robot.tool_jacobian(&q), Arm::new().tool_jacobian(&q));
        assert_eq!((tool, jacobian.as_slice()), (theirs, expected.as_slice()));
    }
}
