//! What a task is: scene, spawn area, named success conditions, milestones of the reward and a dense one, failure classes. One file a task.

mod layout;
mod monitor;
mod observation;
pub mod pick_and_place;
pub mod pick_up;
mod reward;
mod spawn;
pub mod stack;

pub use crate::task::{FailureClass, Task};
pub use layout::with_layout;
pub use monitor::{Monitor, Verdict};
pub use observation::Observation;
pub use reward::dense;
pub use spawn::{REST_HEIGHT_M, draw_scene};

use crate::scene::{BLOCK_EDGE_M, Scene};
use crate::state::Context;

impl Task {
    /// Names of the conditions that are recorded: what has happened so far, then what must hold at once for 0.5 s.
    pub fn condition_names(self) -> &'static [&'static str] {
        match self {
            Task::PickUp => &pick_up::CONDITIONS,
            Task::PickAndPlace => &pick_and_place::CONDITIONS,
            Task::Stack => &stack::CONDITIONS,
        }
    }
}

impl Scene {
    /// Where the block's centre must end: above the start (pick-up), the goal, or on top of the base block \[m\].
    pub fn target_m(&self) -> [f64; 3] {
        match self.context {
            Context::None => {
                let [x, y, _] = self.block.position_m;
                [x, y, pick_up::TARGET_HEIGHT_M]
            }
            Context::Goal(goal) => goal,
            Context::Base(base) => {
                let [x, y, z] = base.position_m;
                [x, y, z + BLOCK_EDGE_M]
            }
        }
    }
}
