//! Lift. Success: at height and gripped (a throw is no success).

use super::Observation;
use super::goal::{Kind, PAID_LIFTED};
use crate::scene::Scene;
use crate::task::Target;

/// Lift and hold.
pub(super) struct Lift;

/// Height of the object's centre above the table that counts \[m\].
pub(super) fn height_m(scene: &Scene, goal: usize) -> f64 {
    match scene.task.goals[goal].target {
        Target::Lift { height_m } => height_m,
        _ => unreachable!("asked of a goal that lifts"),
    }
}

impl Kind for Lift {
    fn conditions(&self) -> &'static [&'static str] {
        &["at_height", "gripped"]
    }

    fn hold(&self, scene: &Scene, goal: usize, seen: &Observation) -> Vec<bool> {
        let object = scene.task.goals[goal].object;
        vec![seen.at(object)[2] >= height_m(scene, goal), seen.gripped(object)]
    }

    fn target_m(&self, scene: &Scene, goal: usize) -> [f64; 3] {
        let [x, y, _] = scene.objects[scene.task.goals[goal].object].pose.position_m;
        [x, y, height_m(scene, goal)]
    }

    fn lifted_m(&self, scene: &Scene, goal: usize) -> f64 {
        height_m(scene, goal)
    }

    fn releases(&self) -> bool {
        false
    }

    fn misses(&self, _: &Scene, _: usize, _: &Observation) -> bool {
        true
    }

    fn paid(&self, lifted: bool, _: bool, _: bool) -> [(bool, f64); 2] {
        [(lifted, PAID_LIFTED), (false, 0.0)]
    }
}
