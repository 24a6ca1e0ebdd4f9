//! What kinematics derive from a state.

use super::hand::{Hand, Vec3, add, sub, turn_back};
use crate::config::FeatureSet;
use crate::nn::Lanes;
use crate::state::{BASE_DIM, JOINTS};
use crate::tasks::{REST_HEIGHT_M, Task};

/// Column of the block's position in a state row.
pub const BLOCK: usize = 2 * JOINTS;
/// Tool position, two columns of the hand's rotation, block in the hand's frame.
pub const HAND_WIDTH: usize = 12;

/// What kinematics derive from a state: tool point, two columns of the hand's rotation, block in the hand's frame, goal minus block.
pub type Relations = [Lanes; MOST_RELATIONS];
/// Entries of [`Relations`] where a task has a goal or a base block; others leave the last three alone.
pub const MOST_RELATIONS: usize = HAND_WIDTH + 3;

/// The relations in a panel of states.
pub fn relations(task: Task, state: &[Lanes], hand: &Hand) -> Relations {
    let block = vec3(state, BLOCK);
    let goal = match task {
        Task::PickUp => None,
        Task::PickAndPlace => Some(vec3(state, BASE_DIM)),
        Task::Stack => Some(add(vec3(state, BASE_DIM), [0.0, 0.0, 2.0 * REST_HEIGHT_M as f32].map(Lanes::splat))),
    };
    let in_hand = turn_back(&hand.columns, sub(block, hand.tool));
    let goal_minus_block = goal.map(|goal| sub(goal, block)).unwrap_or_default();
    let mut related = Relations::default();
    let parts = [hand.tool, hand.columns[0], hand.columns[1], in_hand, goal_minus_block];
    related.iter_mut().zip(parts.iter().flatten()).for_each(|(slot, value)| *slot = *value);
    related
}

/// Number of derived entries of a feature set.
pub fn derived_width(task: Task, set: FeatureSet) -> usize {
    match set {
        FeatureSet::Raw => 0,
        FeatureSet::Fk | FeatureSet::FkNear => HAND_WIDTH + if task == Task::PickUp { 0 } else { 3 },
    }
}

/// Three entries of a panel of rows.
pub fn vec3(row: &[Lanes], at: usize) -> Vec3 {
    [row[at], row[at + 1], row[at + 2]]
}
