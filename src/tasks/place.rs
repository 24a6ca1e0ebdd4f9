//! Place on the table. Success: lifted on the way, then near the place, released, on the table and at rest.

use super::Observation;
use super::goal::{Kind, PAID_THERE};
use super::monitor::OFF_SUPPORT_M;
use super::on::ALIGNED_M;
use crate::scene::Scene;
use crate::task::Target;

/// Least distance between the object's start and the place \[m\].
pub const MIN_TRAVEL_M: f64 = 0.10;

/// Carry to a place on the table and release.
pub(super) struct AtPlace;

impl Kind for AtPlace {
    fn conditions(&self) -> &'static [&'static str] {
        &["at_goal", "released", "on_table", "at_rest"]
    }

    fn hold(&self, scene: &Scene, goal: usize, seen: &Observation) -> Vec<bool> {
        let object = scene.task.goals[goal].object;
        let Target::At { tolerance_m, .. } = scene.task.goals[goal].target else { unreachable!("asked of a goal with a place") };
        let near = seen.distance(object, self.target_m(scene, goal)) < tolerance_m;
        vec![near, seen.released(object), seen.contacts.objects[object].table, seen.rests(object)]
    }

    fn target_m(&self, scene: &Scene, goal: usize) -> [f64; 3] {
        scene.goals[scene.task.place_number(goal).expect("the goal is a place")]
    }

    fn lifted_m(&self, scene: &Scene, goal: usize) -> f64 {
        scene.task.objects[scene.task.goals[goal].object].rest_m() + OFF_SUPPORT_M
    }

    fn misses(&self, scene: &Scene, goal: usize, seen: &Observation) -> bool {
        seen.distance(scene.task.goals[goal].object, self.target_m(scene, goal)) > ALIGNED_M
    }

    fn paid(&self, _: bool, there: bool, _: bool) -> [(bool, f64); 2] {
        [(there, PAID_THERE), (false, 0.0)]
    }
}
