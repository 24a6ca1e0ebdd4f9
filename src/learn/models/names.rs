//! What the inputs of networks are called, so that others than hilt can make them.

use super::relations::HAND_WIDTH;
use crate::layout::Layout;

/// Entries of a position, and of a vector without a unit.
const POSITION: [&str; 3] = ["x_m", "y_m", "z_m"];
const VECTOR: [&str; 3] = ["x", "y", "z"];
/// What a relation's name ends with in place of `_m` where tanh has made a near feature of it.
const NEAR: &str = "_near";

/// What is derived from a state, in order: `hand.tool.x_m`, ..., `block.in_hand.x_m`, ..., `block.to_goal.x_m`, ...; nothing without a known arm.
pub fn relation_names(layout: &Layout) -> Vec<String> {
    if layout.arm.is_none() {
        return Vec::new();
    }
    let of = |what: String, parts: [&str; 3]| parts.map(|part| format!("{what}.{part}"));
    let hand =
        [("tool", POSITION), ("x_axis", VECTOR), ("y_axis", VECTOR)].map(|(what, parts)| of(format!("hand.{what}"), parts));
    let in_hand = layout.objects().map(|(object, _)| of(format!("{object}.in_hand"), POSITION));
    let missing = layout.aims.iter().map(|aim| of(format!("{}.to_{}", aim.object, aim.target), POSITION));
    hand.into_iter().chain(in_hand).chain(missing).flatten().collect()
}

/// The near features of these relations: of all but the hand's.
pub fn near_names(relations: &[String]) -> Vec<String> {
    let near = |name: &String| format!("{}{NEAR}", name.trim_end_matches("_m"));
    relations.iter().skip(HAND_WIDTH).map(near).collect()
}
