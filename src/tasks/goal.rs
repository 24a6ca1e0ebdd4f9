//! A kind of goal: what must hold, where the object goes, what is paid on the way. A goal that the vocabulary lacks is one file with this
//! trait, a line in `kind.rs`, a variant of [`crate::task::Target`] and its words in `task/file.rs`.

use super::Observation;
use crate::scene::Scene;

/// What is paid once for a milestone (paper 4.3).
pub const PAID_REACHED: f64 = 0.01;
/// For the first grip.
pub const PAID_GRASPED: f64 = 0.1;
/// For lifting.
pub const PAID_LIFTED: f64 = 1.0;
/// For the object where it belongs.
pub const PAID_THERE: f64 = 10.0;

/// What a kind of goal knows. `scene` is the one of the episode's start, `goal` the goal's number.
pub trait Kind {
    /// Names of what must hold at once at the end, first that the object is where it belongs.
    fn conditions(&self) -> &'static [&'static str];

    /// Which of them hold.
    fn hold(&self, scene: &Scene, goal: usize, seen: &Observation) -> Vec<bool>;

    /// Where the object's centre must end \[m\], when the goals before this one hold.
    fn target_m(&self, scene: &Scene, goal: usize) -> [f64; 3];

    /// How the object is turned about the vertical then, but for quarter turns \[rad\].
    fn yaw_rad(&self, scene: &Scene, goal: usize) -> f64 {
        scene.objects[scene.task.goals[goal].object].pose.yaw_rad()
    }

    /// Height of the object's centre that counts as lifted \[m\].
    fn lifted_m(&self, scene: &Scene, goal: usize) -> f64;

    /// Whether the hand lets go in the end.
    fn releases(&self) -> bool {
        true
    }

    /// Whether a released object is not where it belongs: tells `misplaced` from `timed_out`.
    fn misses(&self, scene: &Scene, goal: usize, seen: &Observation) -> bool;

    /// What is paid, each once: for lifting, and for the object where it belongs (`there`) or all conditions met (`done`).
    fn paid(&self, lifted: bool, there: bool, done: bool) -> [(bool, f64); 2];
}
