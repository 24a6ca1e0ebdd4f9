//! Which joints of a URDF are the arm's and the fingers', by how they hang on each other.

use crate::robot::file::read_urdf::{JointElement, Urdf};
use std::collections::BTreeMap;

/// The joints by their part.
#[derive(Debug, Default, PartialEq)]
pub struct Skeleton {
    /// The arm's, from the foot to the hand.
    pub arm: Vec<String>,
    /// The first joint of each branch of the hand.
    pub fingers: Vec<String>,
    /// All others that move, and where they are held \[rad, m\].
    pub fixed: BTreeMap<String, f64>,
}

/// The chain from the foot to the last link on which several joints branch off, which is the hand.
///
/// # Errors
/// When nothing branches off: a hand has two fingers at least.
pub fn skeleton(urdf: &Urdf, foot: &str) -> Result<Skeleton, String> {
    let tree = Tree(urdf);
    let (mut skeleton, mut at) = (Skeleton::default(), foot);
    loop {
        let branches = tree.moving(at);
        let next = match &branches[..] {
            [] => {
                return Err("no two joints branch off at the end of the arm: hilt needs a hand of two or more fingers that move; one jaw against a \
                            fixed one will not do"
                    .into());
            }
            [only] => only,
            several => match several
                .iter()
                .filter(|joint| tree.branches_below(&joint.child))
                .max_by_key(|joint| tree.depth(&joint.child))
            {
                Some(deepest) => {
                    several.iter().filter(|joint| joint.name != deepest.name).for_each(|joint| tree.hold(joint, &mut skeleton));
                    deepest
                }
                None => {
                    for finger in several {
                        skeleton.fingers.push(finger.name.clone());
                        tree.moving(&finger.child).iter().for_each(|joint| tree.hold(joint, &mut skeleton));
                    }
                    return Ok(skeleton);
                }
            },
        };
        // An arm turns: a rail under it is held.
        if next.kind == "prismatic" {
            skeleton.fixed.insert(next.name.clone(), held_at(next));
        } else {
            skeleton.arm.push(next.name.clone());
        }
        at = &next.child;
    }
}

/// Where a joint is held that is neither the arm's nor a finger's: at 0, or, where it follows another as the linkage of a gripper does, half way.
pub fn held_at(joint: &JointElement) -> f64 {
    match joint.range {
        Some([low, high]) if joint.mimics.is_some() => (low + high) / 2.0,
        Some([low, high]) if low <= high => 0.0f64.clamp(low, high),
        _ => 0.0,
    }
}

struct Tree<'a>(&'a Urdf);

impl<'a> Tree<'a> {
    /// The joints that move next, behind fixed ones.
    fn moving(&self, link: &str) -> Vec<&'a JointElement> {
        let mut found = Vec::new();
        for joint in self.0.joints.iter().filter(|joint| joint.parent == link) {
            match joint.kind.as_str() {
                "fixed" => found.extend(self.moving(&joint.child)),
                _ => found.push(joint),
            }
        }
        found
    }

    /// How many joints that move hang behind each other from here.
    fn depth(&self, link: &str) -> usize {
        self.moving(link).iter().map(|joint| 1 + self.depth(&joint.child)).max().unwrap_or(0)
    }

    /// Whether several joints branch off here or below.
    fn branches_below(&self, link: &str) -> bool {
        let next = self.moving(link);
        next.len() > 1 || next.iter().any(|joint| self.branches_below(&joint.child))
    }

    /// Holds a joint and all below it.
    fn hold(&self, joint: &JointElement, skeleton: &mut Skeleton) {
        skeleton.fixed.insert(joint.name.clone(), held_at(joint));
        self.moving(&joint.child).iter().for_each(|below| self.hold(below, skeleton));
    }
}
