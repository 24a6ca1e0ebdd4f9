//! What follows from a task's file: scene, named success conditions, milestones of the reward and a dense one, failure classes, layout. One
//! file a kind of goal.

mod dense_reward;
mod goal;
mod inside;
mod kind;
mod layout;
mod lift;
mod monitor;
mod observation;
mod on;
mod place;
mod spawn;

pub use crate::task::{FailureClass, Task};
pub use dense_reward::dense;
pub use goal::Kind;
pub use layout::with_layout;
pub use monitor::{Monitor, Verdict};
pub use observation::Observation;
pub use on::ALIGNED_M;
pub use place::MIN_TRAVEL_M;
pub use spawn::{draw_scene, scene_of};

use crate::scene::Scene;

/// Conditions of every goal before those of its kind.
const ON_THE_WAY: [&str; 3] = ["reached", "grasped", "lifted"];

impl Task {
    /// Names of the conditions that are recorded, goal after goal: what has happened so far, then what must hold at once for 0.5 s. Of
    /// several goals they begin with the object's name.
    pub fn condition_names(&self) -> Vec<String> {
        let of = |k: usize| {
            let prefix =
                if self.goals.len() > 1 { format!("{}.", self.objects[self.goals[k].object].name) } else { String::new() };
            ON_THE_WAY.iter().chain(self.goals[k].kind().conditions()).map(move |name| format!("{prefix}{name}"))
        };
        (0..self.goals.len()).flat_map(of).collect()
    }
}

impl Scene {
    /// Where the centre of the object of a goal must end \[m\].
    pub fn target_m(&self, goal: usize) -> [f64; 3] {
        self.task.goals[goal].kind().target_m(self, goal)
    }

    /// Where an object is when the goals before `goal` hold \[m\].
    pub fn place_after(&self, object: usize, goal: usize) -> [f64; 3] {
        match self.task.goal_of(object).filter(|before| *before < goal) {
            Some(before) => self.target_m(before),
            None => self.objects[object].pose.position_m,
        }
    }
}
