//! Whether links and joints make a robot at all, and whether the description names what is there.

use super::description::{Description, ShapeEntry};
use super::read_urdf::{JointElement, Urdf};
use crate::layout::MOST_ARM_JOINTS;
use crate::words::{did_you_mean, shown};
use std::collections::{BTreeMap, BTreeSet};

/// Most links of a document: each costs a look at its joints.
const MOST_LINKS: usize = 256;
/// Most fingers.
const MOST_FINGERS: usize = 5;

/// The one link that hangs on nothing.
///
/// # Errors
/// Names what is there twice, hangs on nothing or in a loop.
pub fn foot(urdf: &Urdf) -> Result<&str, String> {
    if urdf.links.is_empty() || urdf.links.len() > MOST_LINKS {
        return Err(format!("the URDF has {} links; allowed: 1 to {MOST_LINKS}", urdf.links.len()));
    }
    let mut names = BTreeSet::new();
    if let Some(twice) = urdf.links.iter().find(|link| !names.insert(link.name.as_str())) {
        return Err(format!("line {} of the URDF: two links are called \"{}\"", twice.line, shown(&twice.name)));
    }
    let (mut joints, mut parents) = (BTreeSet::new(), BTreeMap::new());
    for joint in &urdf.joints {
        let name = shown(&joint.name);
        if !joints.insert(joint.name.as_str()) {
            return Err(format!("line {} of the URDF: two joints are called \"{name}\"", joint.line));
        }
        if let Some(unknown) = [&joint.parent, &joint.child].into_iter().find(|link| !names.contains(link.as_str())) {
            let known: Vec<&str> = names.iter().copied().collect();
            let hint = did_you_mean(unknown, known);
            return Err(format!(
                "line {} of the URDF, joint \"{name}\": there is no link \"{}\"{hint}",
                joint.line,
                shown(unknown)
            ));
        }
        if let Some(other) = parents.insert(joint.child.as_str(), joint) {
            let (link, other) = (shown(&joint.child), shown(&other.name));
            return Err(format!(
                "line {} of the URDF: link \"{link}\" hangs on two joints, \"{other}\" and \"{name}\": a robot is a tree",
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
        Some(link) => {
            Err(format!("line {} of the URDF: link \"{}\" hangs on itself: its joints make a loop", link.line, shown(&link.name)))
        }
    }
}

/// Longest name of a robot.
const LONGEST_NAME: usize = 64;

/// A robot's name is that of a directory of its runs.
fn check_own_name(name: &str) -> Result<(), String> {
    let letters = name.bytes().all(|b| b.is_ascii_alphanumeric() || b"._-".contains(&b));
    if letters && name.starts_with(|c: char| c.is_ascii_alphanumeric()) && name.len() <= LONGEST_NAME {
        return Ok(());
    }
    Err(format!(
        "name = \"{}\" is no name of a directory: up to {LONGEST_NAME} letters, digits, dots, - and _, a letter or digit first",
        shown(name)
    ))
}

/// Every joint and link that the description names is there, and is named once.
///
/// # Errors
/// Names the key, and what is allowed.
pub fn check_names(description: &Description, urdf: &Urdf) -> Result<(), String> {
    check_own_name(&description.name)?;
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
    description.joints.keys().try_for_each(|name| known("joints", "joint", name, &joints))?;
    for name in description.posture.keys() {
        if !description.arm.contains(name) {
            let arm: Vec<&str> = description.arm.iter().map(String::as_str).collect();
            return Err(format!("posture: \"{}\" is no joint of the arm{}", shown(name), did_you_mean(name, arm)));
        }
    }
    for (name, shapes) in &description.shapes {
        known("shapes", "link", name, &links)?;
        let sizes = |shape: &ShapeEntry| match *shape {
            ShapeEntry::Capsule { radius_m, .. } => vec![radius_m],
            ShapeEntry::Box { half_m, .. } => half_m.to_vec(),
        };
        if let Some(size) = shapes.iter().flat_map(sizes).find(|size| *size <= 0.0) {
            return Err(format!("shapes.{}: a size of {size} m; it must be above 0", shown(name)));
        }
    }
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
