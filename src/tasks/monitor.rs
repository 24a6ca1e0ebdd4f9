//! Watches an episode: conditions by name, milestones of the reward, success, and the class of a failure.

use super::goal::{PAID_GRASPED, PAID_REACHED};
use super::observation::Observation;
use crate::math::cos;
use crate::scene::Scene;
use crate::state::CONTROL_HZ;
use crate::task::{FailureClass, Target};
use nalgebra::Vector3;

/// Steps that all goal conditions must hold without a break: 0.5 s.
pub const HOLD_STEPS: u32 = CONTROL_HZ / 2;
/// The hand has approached when its tool point is this near to where the object is held \[m\].
const REACH_M: f64 = 0.05;
/// An object has left the table when its centre is this much higher than at rest \[m\].
pub(super) const OFF_SUPPORT_M: f64 = 0.02;
/// An object that leans more than this has toppled \[rad\] (30 degrees).
const TOPPLE_RAD: f64 = std::f64::consts::FRAC_PI_6;

/// The monitor's word on one moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// Values of `task.condition_names()`.
    pub conditions: Vec<bool>,
    /// For each goal, whether all of its conditions hold and its object was carried.
    pub met: Vec<bool>,
    /// Reward of milestones reached just now.
    pub reward: f64,
    /// Whether all goals have been met for `HOLD_STEPS`.
    pub success: bool,
}

/// Follows one episode.
#[derive(Clone, Debug)]
pub struct Monitor {
    scene: Scene,
    goals: Vec<History>,
    hold: u32,
}

/// What has happened to the object of a goal.
#[derive(Clone, Debug, Default)]
struct History {
    reached: bool,
    grasped: bool,
    lifted: bool,
    off_table: bool,
    met_once: bool,
    /// Whether the object touched nothing when the grip was last lost.
    lost_in_air: bool,
    was_gripped: bool,
    paid: [bool; 4],
}

impl Monitor {
    /// At the start of an episode.
    pub fn new(scene: &Scene) -> Self {
        Monitor { scene: scene.clone(), goals: vec![History::default(); scene.task.goals.len()], hold: 0 }
    }

    /// Looks at one moment.
    pub fn update(&mut self, seen: &Observation) -> Verdict {
        let mut verdict = Verdict { conditions: Vec::new(), met: Vec::new(), reward: 0.0, success: false };
        for (goal, history) in self.goals.iter_mut().enumerate() {
            history.update(&self.scene, goal, seen, &mut verdict);
        }
        self.hold = if verdict.met.iter().all(|met| *met) { self.hold + 1 } else { 0 };
        verdict.success = self.hold >= HOLD_STEPS;
        verdict
    }

    /// The class of a failed episode, from its history and its last moment: that of the first goal that is not met.
    pub fn classify(&self, last: &Observation) -> FailureClass {
        let met = |goal: &usize| {
            let kind = self.scene.task.goals[*goal].kind();
            self.goals[*goal].off_table && kind.hold(&self.scene, *goal, last).iter().all(|holds| *holds)
        };
        let all = 0..self.goals.len();
        let goal = all.clone().find(|goal| !met(goal)).unwrap_or(all.end - 1);
        self.goals[goal].classify(&self.scene, goal, last)
    }
}

impl History {
    /// Looks at one moment; adds what holds, and what is paid, to the verdict.
    fn update(&mut self, scene: &Scene, goal: usize, seen: &Observation, verdict: &mut Verdict) {
        let (number, kind) = (scene.task.goals[goal].object, scene.task.goals[goal].kind());
        let object = &scene.task.objects[number];
        let (height, gripped) = (seen.at(number)[2], seen.gripped(number));
        let [x, y, z] = seen.at(number);
        let held = [x, y, z + object.held_m()];
        self.reached |= (Vector3::from(held) - Vector3::from(seen.tool_m)).norm() < REACH_M;
        self.grasped |= gripped;
        self.off_table |= gripped && height > object.rest_m() + OFF_SUPPORT_M;
        self.lifted |= gripped && height >= kind.lifted_m(scene, goal);
        if gripped {
            self.lost_in_air = false;
        } else if self.was_gripped {
            self.lost_in_air = !seen.touches(number);
        }
        self.was_gripped = gripped;

        let holds = kind.hold(scene, goal, seen);
        let all = holds.iter().all(|holds| *holds);
        let met = all && self.off_table;
        self.met_once |= met;
        verdict.conditions.extend([self.reached, self.grasped, self.lifted]);
        verdict.conditions.extend(&holds);
        verdict.met.push(met);
        verdict.reward += self.reward(kind.paid(self.lifted, self.off_table && holds[0], all));
    }

    /// Milestones (paper 4.3, read as in the method notes): each is paid once.
    fn reward(&mut self, of_kind: [(bool, f64); 2]) -> f64 {
        let [lifted, there] = of_kind;
        let milestones = [(self.reached, PAID_REACHED), (self.grasped, PAID_GRASPED), lifted, there];
        let mut reward = 0.0;
        for ((met, value), paid) in milestones.into_iter().zip(&mut self.paid) {
            if met && !*paid {
                *paid = true;
                reward += value;
            }
        }
        reward
    }

    fn classify(&self, scene: &Scene, goal: usize, last: &Observation) -> FailureClass {
        let (object, kind) = (scene.task.goals[goal].object, scene.task.goals[goal].kind());
        let gripped = last.gripped(object);
        let leaning = last.objects[object].pose.uprightness(&scene.objects[object].pose) < cos(TOPPLE_RAD);
        let off_after_met = match scene.task.goals[goal].target {
            Target::On(other) => self.met_once && !last.contacts.objects[object].objects.contains(&other) && !gripped,
            _ => false,
        };
        if !self.reached {
            FailureClass::NeverReached
        } else if !self.grasped {
            FailureClass::NeverGrasped
        } else if support_pushed(scene, last) || off_after_met || (leaning && !gripped) {
            FailureClass::Toppled
        } else if gripped {
            FailureClass::TimedOut
        } else if self.lost_in_air || !self.off_table {
            FailureClass::Dropped
        } else if !kind.releases() || last.released(object) && kind.misses(scene, goal, last) {
            FailureClass::Misplaced
        } else {
            FailureClass::TimedOut
        }
    }
}

/// Whether an object that no goal moves was pushed by more than half of its width.
fn support_pushed(scene: &Scene, last: &Observation) -> bool {
    (scene.task.moved()..scene.objects.len()).any(|object| {
        let then = scene.objects[object].pose.position_m;
        let pushed = (Vector3::from(last.at(object)) - Vector3::from(then)).norm();
        pushed > scene.task.objects[object].shape.half_width_m()
    })
}
