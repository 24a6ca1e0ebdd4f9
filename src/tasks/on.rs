//! Stack. Success: resting on the other object alone, released by all fingers and at rest.

use super::Observation;
use super::goal::{Kind, PAID_LIFTED, PAID_THERE};
use crate::math::hypot;
use crate::scene::Scene;
use crate::task::Target;

/// Horizontal offset of the two centres up to which a block rests on the other \[m\]: half an edge of 5 cm.
pub const ALIGNED_M: f64 = 0.025;
/// The object's centre is as far above the other's as the two halves are high, give or take this \[m\].
const LEVEL_M: f64 = 0.01;
/// The lower face of an object that earns the lift milestone is this far above the other's top \[m\].
const OVER_M: f64 = 0.025;

/// Put on top of another object and release.
pub(super) struct OnTop;

/// The object that it is put on.
fn support(scene: &Scene, goal: usize) -> usize {
    match scene.task.goals[goal].target {
        Target::On(other) => other,
        _ => unreachable!("asked of a goal on top of something"),
    }
}

/// From centre to centre \[m\].
fn rise_m(scene: &Scene, goal: usize) -> f64 {
    let objects = &scene.task.objects;
    objects[support(scene, goal)].rest_m() + objects[scene.task.goals[goal].object].rest_m()
}

impl Kind for OnTop {
    fn conditions(&self) -> &'static [&'static str] {
        &["on_base", "released", "at_rest"]
    }

    fn hold(&self, scene: &Scene, goal: usize, seen: &Observation) -> Vec<bool> {
        let (object, other) = (scene.task.goals[goal].object, support(scene, goal));
        let (at, base) = (seen.at(object), seen.at(other));
        let [dx, dy, dz] = std::array::from_fn(|i| at[i] - base[i]);
        let aligned = hypot(dx, dy) < ALIGNED_M && (dz - rise_m(scene, goal)).abs() < LEVEL_M;
        let touch = &seen.contacts.objects[object];
        vec![aligned && touch.objects.contains(&other) && !touch.table, seen.released(object), seen.rests(object)]
    }

    fn target_m(&self, scene: &Scene, goal: usize) -> [f64; 3] {
        let [x, y, z] = scene.place_after(support(scene, goal), goal);
        [x, y, z + rise_m(scene, goal)]
    }

    fn yaw_rad(&self, scene: &Scene, goal: usize) -> f64 {
        let other = support(scene, goal);
        match scene.task.goal_of(other) {
            Some(before) => scene.task.goals[before].kind().yaw_rad(scene, before),
            None => scene.objects[other].pose.yaw_rad(),
        }
    }

    fn lifted_m(&self, scene: &Scene, goal: usize) -> f64 {
        self.target_m(scene, goal)[2] + OVER_M
    }

    fn misses(&self, scene: &Scene, goal: usize, seen: &Observation) -> bool {
        seen.distance(scene.task.goals[goal].object, self.target_m(scene, goal)) > ALIGNED_M
    }

    fn paid(&self, lifted: bool, _: bool, done: bool) -> [(bool, f64); 2] {
        [(lifted, PAID_LIFTED), (done, PAID_THERE)]
    }
}
