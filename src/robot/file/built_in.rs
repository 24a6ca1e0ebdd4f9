//! The robots that come with hilt: the files of `pipelines/robots`, as they were when it was built.

use super::assemble::assemble;
use super::description::Description;
use super::read_urdf;
use crate::error::{Error, Result};
use crate::robot::model::Robot;
use crate::words::unknown;
use std::sync::{Arc, LazyLock};

/// Name, TOML and URDF of each.
const FILES: [(&str, &str, &str); 3] = [
    ("jaco", include_str!("../../../pipelines/robots/jaco.toml"), include_str!("../../../pipelines/robots/jaco.urdf")),
    ("panda", include_str!("../../../pipelines/robots/panda.toml"), include_str!("../../../pipelines/robots/panda.urdf")),
    ("ur5e", include_str!("../../../pipelines/robots/ur5e.toml"), include_str!("../../../pipelines/robots/ur5e.urdf")),
];

static PAPER_ROBOT: LazyLock<Arc<Robot>> =
    LazyLock::new(|| Arc::new(named("jaco").expect("it is there").expect("its files are tested")));

/// The robot of the paper, a Kinova Jaco j2n6s300; that of every file that does not say whose it is, from when there was no other.
pub fn paper_robot() -> Arc<Robot> {
    Arc::clone(&PAPER_ROBOT)
}

/// Names of all.
pub fn names() -> [&'static str; FILES.len()] {
    FILES.map(|(name, ..)| name)
}

/// The one of this name; `None` when there is none.
///
/// # Errors
/// What is wrong with its files.
pub fn named(name: &str) -> Option<std::result::Result<Robot, String>> {
    let (_, description, urdf) = FILES.iter().find(|(known, ..)| *known == name)?;
    let read = || {
        let (description, document) = (Description::parse(description)?, read_urdf::read(urdf)?);
        assemble(&description, &document, &|mesh| Err(format!("{mesh}: a built-in robot has no meshes"))).map(|read| read.robot)
    };
    Some(read())
}

/// As [`named`], for a name that a person has given.
///
/// # Errors
/// [`Error::Usage`] says which names there are.
pub fn find(name: &str) -> Result<Robot> {
    let unknown = || Error::Usage(format!("{}; or name a file that ends in .toml", unknown("robot", name, &names())));
    named(name).ok_or_else(unknown)?.map_err(Error::Failed)
}

/// All of them.
///
/// # Panics
/// Never: their files are tested.
pub fn all() -> impl Iterator<Item = Arc<Robot>> {
    names().into_iter().map(|name| Arc::new(named(name).expect("it is there").expect("its files are tested")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_built_in_robot_is_sound() {
        for name in names() {
            let robot = named(name).expect("it is there").expect("its files are sound");
            assert_eq!(robot.name, name);
            assert!(robot.reach_m.is_some() && !robot.opposing.is_empty(), "{name}");
        }
        assert!(named("puma").is_none());
    }

    #[test]
    fn the_jacos_thumb_opposes_both_its_fingers() {
        let robot = paper_robot();
        assert_eq!((robot.arm, robot.hand(), robot.joints.len(), robot.links.len()), (6, 6, 9, 10));
        assert_eq!(robot.opposing, [[0, 1], [0, 2]]);
    }
}
