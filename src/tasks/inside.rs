//! Put into a bin. Success: between its walls and on the table, released and at rest.

use super::Observation;
use super::goal::{Kind, PAID_LIFTED, PAID_THERE};
use crate::scene::Scene;
use crate::task::{Shape, Target};

/// The lower face of an object that earns the lift milestone is this far above the walls \[m\].
const OVER_M: f64 = 0.01;

/// Put between walls and release.
pub(super) struct Inside;

/// The bin, the space between its walls \[m\] and their height \[m\].
fn bin(scene: &Scene, goal: usize) -> (usize, [f64; 2], f64) {
    if let Target::In(bin) = scene.task.goals[goal].target
        && let Shape::Bin { inner_m, height_m } = scene.task.objects[bin].shape
    {
        return (bin, inner_m, height_m);
    }
    unreachable!("asked of a goal in a bin")
}

/// Whether the object's centre is between the walls.
fn is_between(scene: &Scene, goal: usize, seen: &Observation) -> bool {
    let (bin, inner_m, height_m) = bin(scene, goal);
    let object = scene.task.goals[goal].object;
    let at = scene.objects[bin].pose.isometry().inverse_transform_point(&seen.at(object).into());
    let low = at.z < scene.task.objects[object].rest_m() + height_m / 2.0;
    (0..2).all(|i| at[i].abs() < inner_m[i] / 2.0) && low
}

impl Kind for Inside {
    fn conditions(&self) -> &'static [&'static str] {
        &["in_bin", "released", "on_table", "at_rest"]
    }

    fn hold(&self, scene: &Scene, goal: usize, seen: &Observation) -> Vec<bool> {
        let object = scene.task.goals[goal].object;
        let between = is_between(scene, goal, seen);
        vec![between, seen.released(object), seen.contacts.objects[object].table, seen.rests(object)]
    }

    fn target_m(&self, scene: &Scene, goal: usize) -> [f64; 3] {
        let [x, y, _] = scene.objects[bin(scene, goal).0].pose.position_m;
        [x, y, scene.task.objects[scene.task.goals[goal].object].rest_m()]
    }

    fn lifted_m(&self, scene: &Scene, goal: usize) -> f64 {
        let (.., height_m) = bin(scene, goal);
        height_m + OVER_M + scene.task.objects[scene.task.goals[goal].object].rest_m()
    }

    fn misses(&self, scene: &Scene, goal: usize, seen: &Observation) -> bool {
        !is_between(scene, goal, seen)
    }

    fn paid(&self, lifted: bool, _: bool, done: bool) -> [(bool, f64); 2] {
        [(lifted, PAID_LIFTED), (done, PAID_THERE)]
    }
}
