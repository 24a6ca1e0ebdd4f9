//! Watches an episode: conditions by name, milestones of the reward, success, and the class of a failure.

use super::observation::Observation;
use super::{pick_and_place, pick_up, stack};
use crate::math::cos;
use crate::scene::{BLOCK_EDGE_M, Scene};
use crate::state::CONTROL_HZ;
use crate::task::{FailureClass, Task};
use nalgebra::Vector3;

/// Steps that all goal conditions must hold without a break: 0.5 s.
pub const HOLD_STEPS: u32 = CONTROL_HZ / 2;
/// The hand has approached when its tool point is this near to the block's centre \[m\].
const REACH_M: f64 = 0.05;
/// The block has left the table when its centre is this high \[m\] (2 cm above its resting height).
const OFF_TABLE_M: f64 = BLOCK_EDGE_M / 2.0 + 0.02;
/// A block that leans more than this has toppled \[rad\] (30 degrees).
const TOPPLE_RAD: f64 = std::f64::consts::FRAC_PI_6;
/// The base block counts as pushed away beyond this \[m\]: half an edge.
const BASE_PUSHED_M: f64 = BLOCK_EDGE_M / 2.0;

/// The monitor's word on one moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// Values of `task.condition_names()`.
    pub conditions: Vec<bool>,
    /// Reward of milestones reached just now.
    pub reward: f64,
    /// Whether all goal conditions have held for `HOLD_STEPS`.
    pub success: bool,
}

/// Follows one episode.
#[derive(Clone, Debug)]
pub struct Monitor {
    scene: Scene,
    reached: bool,
    grasped: bool,
    lifted: bool,
    off_table: bool,
    solved_once: bool,
    /// Whether the block touched neither table nor base block when the grip was last lost.
    lost_in_air: bool,
    was_gripped: bool,
    paid: [bool; 4],
    hold: u32,
}

impl Monitor {
    /// At the start of an episode.
    pub fn new(scene: &Scene) -> Self {
        Monitor {
            scene: scene.clone(),
            reached: false,
            grasped: false,
            lifted: false,
            off_table: false,
            solved_once: false,
            lost_in_air: false,
            was_gripped: false,
            paid: [false; 4],
            hold: 0,
        }
    }

    /// Looks at one moment.
    pub fn update(&mut self, seen: &Observation) -> Verdict {
        let height = seen.state.block.position_m[2];
        let gripped = seen.gripped();
        self.reached |= seen.block_to(seen.tool_m) < REACH_M;
        self.grasped |= gripped;
        self.off_table |= gripped && height > OFF_TABLE_M;
        self.lifted |= gripped && height >= lift_height(self.scene.task);
        if gripped {
            self.lost_in_air = false;
        } else if self.was_gripped {
            self.lost_in_air = !seen.contacts.block_table && !seen.contacts.block_base;
        }
        self.was_gripped = gripped;

        let goal: Vec<bool> = match self.scene.task {
            Task::PickUp => pick_up::goal_conditions(seen).to_vec(),
            Task::PickAndPlace => pick_and_place::goal_conditions(seen, self.scene.target_m()).to_vec(),
            Task::Stack => stack::goal_conditions(seen).to_vec(),
        };
        let all = goal.iter().all(|c| *c) && self.off_table;
        self.solved_once |= all;
        self.hold = if all { self.hold + 1 } else { 0 };
        let mut conditions = vec![self.reached, self.grasped, self.lifted];
        conditions.extend(&goal);
        Verdict { reward: self.reward(&goal), conditions, success: self.hold >= HOLD_STEPS }
    }

    /// Milestones (paper 4.3, read as in the method notes): each is paid once.
    fn reward(&mut self, goal: &[bool]) -> f64 {
        let milestones: [(bool, f64); 4] = match self.scene.task {
            Task::PickUp => [(self.reached, 0.01), (self.grasped, 0.1), (self.lifted, 1.0), (false, 0.0)],
            Task::PickAndPlace => [(self.reached, 0.01), (self.grasped, 0.1), (self.off_table && goal[0], 10.0), (false, 0.0)],
            Task::Stack => [(self.reached, 0.01), (self.grasped, 0.1), (self.lifted, 1.0), (goal.iter().all(|c| *c), 10.0)],
        };
        let mut reward = 0.0;
        for ((met, value), paid) in milestones.into_iter().zip(&mut self.paid) {
            if met && !*paid {
                *paid = true;
                reward += value;
            }
        }
        reward
    }

    /// The class of a failed episode, from its history and its last moment.
    pub fn classify(&self, last: &Observation) -> FailureClass {
        let up = last.state.block.isometry() * self.start_up_axis();
        let leaning = up.z < cos(TOPPLE_RAD);
        let base_pushed = match (last.base_now, self.scene.context) {
            (Some(now), crate::state::Context::Base(then)) => {
                (Vector3::from(now.position_m) - Vector3::from(then.position_m)).norm() > BASE_PUSHED_M
            }
            _ => false,
        };
        let off_after_solved = self.scene.task == Task::Stack && self.solved_once && !last.contacts.block_base && !last.gripped();
        if !self.reached {
            FailureClass::NeverReached
        } else if !self.grasped {
            FailureClass::NeverGrasped
        } else if base_pushed || off_after_solved || (leaning && !last.gripped()) {
            FailureClass::Toppled
        } else if last.gripped() {
            FailureClass::TimedOut
        } else if self.lost_in_air || !self.off_table {
            FailureClass::Dropped
        } else if self.scene.task == Task::PickUp || last.released() && last.block_to(self.scene.target_m()) > stack::ALIGNED_M {
            FailureClass::Misplaced
        } else {
            FailureClass::TimedOut
        }
    }

    /// The block's axis that pointed up at the start, in its own frame.
    fn start_up_axis(&self) -> Vector3<f64> {
        self.scene.block.isometry().rotation.inverse() * Vector3::z()
    }
}

/// Height of the block's centre that counts as lifted \[m\].
fn lift_height(task: Task) -> f64 {
    match task {
        Task::PickUp => pick_up::TARGET_HEIGHT_M,
        Task::PickAndPlace => OFF_TABLE_M,
        Task::Stack => stack::LIFT_HEIGHT_M,
    }
}
