//! The dense reward: how far a task has come, in every step. It is not the paper's, whose milestones ([`super::Monitor`]) say nothing on
//! the way to them; it exists so that reinforcement learning gets a fair chance. Its stages are those of ManiSkill's PickCube and
//! StackCube, fitted to a hand with three fingers:
//!
//! | goal | before the grasp | gripped | where the task wants it |
//! |---|---|---|---|
//! | all | 2 near(tool to object) + 1.5 around(tool to object) closed | | |
//! | lift | | 4 + 3 near(height still to rise) | 8: at height, gripped |
//! | place at, on, in | | 4 + near(object to target) | 6 + opened + still |
//!
//! over 8, so that a step earns at most 1; near(d) = 1 - tanh(d / 20 cm), around(d) = 1 - tanh(d / 3 cm). The fingers are driven by their
//! velocities, and noise alone hardly ever closes two of them: the way there is paid too. An episode ends with success, which must not
//! cost what standing there for ever would earn: the step that solves the task earns 1 / (1 - gamma) besides.

use super::lift::height_m;
use super::observation::Observation;
use super::{ON_THE_WAY, Verdict};
use crate::math::tanh;
use crate::robot::Robot;
use crate::scene::Scene;
use crate::task::Target;
use nalgebra::Vector3;

/// What the best step short of success earns before it is scaled to 1.
const MOST: f64 = 8.0;
/// Distances are told apart within this \[m\]: near(d) is 1/2 at 11 cm.
const NEAR_M: f64 = 0.2;
/// The fingers are around the object when the tool point is within this of its centre \[m\]; above a 5 cm cube it is not.
const AROUND_M: f64 = 0.03;
/// Speeds are told apart within this \[m/s\].
const STILL_M_S: f64 = 0.1;
/// Position of the condition `lifted` among those of a goal; after it comes that the object is where it belongs.
const LIFTED: usize = ON_THE_WAY.len() - 1;

/// Reward of the step that led to `seen`, between 0 and 1, or up to 1 + 1 / (1 - `gamma`) with success. A goal counts as much as another; those
/// after the first that is not met count nothing yet.
pub fn dense(scene: &Scene, seen: &Observation, verdict: &Verdict, gamma: f64) -> f64 {
    let bonus = if verdict.success { 1.0 / (1.0 - gamma) } else { 0.0 };
    let goals = verdict.met.len();
    let before = verdict.met.iter().take_while(|met| **met).count().min(goals - 1);
    (before as f64 * MOST + stage(scene, before, seen, verdict)) / (goals as f64 * MOST) + bonus
}

fn stage(scene: &Scene, goal: usize, seen: &Observation, verdict: &Verdict) -> f64 {
    let object = scene.task.goals[goal].object;
    let first: usize = scene.task.goals[..goal].iter().map(|goal| ON_THE_WAY.len() + goal.kind().conditions().len()).sum();
    let at_goal = verdict.conditions[first + LIFTED] && verdict.conditions[first + LIFTED + 1];
    let gripped = seen.gripped(object);
    match scene.task.goals[goal].target {
        Target::Lift { .. } if gripped => {
            let still_to_rise = (height_m(scene, goal) - seen.at(object)[2]).max(0.0);
            if still_to_rise > 0.0 { 4.0 + 3.0 * near(still_to_rise, NEAR_M) } else { MOST }
        }
        Target::At { .. } | Target::On(_) | Target::In(_) if at_goal => 6.0 + opened(seen, object) + still(seen, object),
        Target::At { .. } | Target::On(_) | Target::In(_) if gripped => {
            4.0 + near(seen.distance(object, scene.target_m(goal)), NEAR_M)
        }
        _ => {
            let [x, y, z] = seen.at(object);
            let held = Vector3::new(x, y, z + scene.task.objects[object].held_m());
            let away = (held - Vector3::from(seen.tool_m)).norm();
            2.0 * near(away, NEAR_M) + 1.5 * near(away, AROUND_M) * closed(seen)
        }
    }
}

/// 1 at no distance, 0 beyond a few times `scale_m`.
fn near(distance_m: f64, scale_m: f64) -> f64 {
    1.0 - tanh(distance_m / scale_m)
}

/// How far the fingers are closed, 0 to 1: from as far open as they go to closed around nothing.
fn closed(seen: &Observation) -> f64 {
    let robot = &*seen.robot;
    let way = |i: usize, to: f64| (to - widest(robot, i)) * robot.closing_way(i).signum();
    let gone: f64 = robot.fingers().enumerate().map(|(i, joint)| way(i, seen.state.q[joint])).sum();
    let whole: f64 = robot.closed.iter().enumerate().map(|(i, closed)| way(i, *closed)).sum();
    (gone / whole).clamp(0.0, 1.0)
}

/// Where finger `i` is as far open as it goes \[rad, m\].
fn widest(robot: &Robot, i: usize) -> f64 {
    let [low, high] = robot.joints[robot.arm + i].limits;
    if robot.closing_way(i) > 0.0 { low } else { high }
}

/// How far the fingers are open; 1 once they have let go.
fn opened(seen: &Observation, object: usize) -> f64 {
    if seen.released(object) { 1.0 } else { 1.0 - closed(seen) }
}

/// 1 for an object at rest.
fn still(seen: &Observation, object: usize) -> f64 {
    1.0 - tanh(seen.objects[object].speed_m_s / STILL_M_S)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::SceneSettings;
    use crate::demo::{Body, Contacts};
    use crate::robot::file::built_in::paper_robot;
    use crate::seed::stream;
    use crate::state::State;
    use crate::task::built_in::of_the_paper;
    use crate::tasks::{Monitor, Task, draw_scene};
    use std::sync::Arc;

    const GAMMA: f64 = 0.9;

    /// The block at `block_m`, the tool `away_m` above it; gripped or not.
    fn seen(scene: &Scene, block_m: [f64; 3], away_m: f64, gripped: bool) -> Observation {
        let force = if gripped { 1.0 } else { 0.0 };
        let mut state = State { q: [0.7; 9].into(), dq: [0.0; 9].into(), ..scene.start() };
        state.objects[0].position_m = block_m;
        let objects = state.objects.iter().map(|pose| Body { pose: *pose, speed_m_s: 0.0 }).collect();
        let mut contacts = Contacts::none(3, scene.objects.len());
        let touches = |height: f64| block_m[2] < height + 1e-6;
        contacts.objects[0].fingers_n = [force; 3].into();
        contacts.objects[0].table = touches(0.025);
        if !touches(0.025) && touches(0.075) && scene.objects.len() > 1 {
            contacts.objects[0].objects.insert(1);
        }
        Observation { robot: paper_robot(), state, tool_m: [block_m[0], block_m[1], block_m[2] + away_m], objects, contacts }
    }

    /// What the stages of a task earn, one after another: far, near, gripped, on the way, where it belongs, released there until solved.
    fn earned(task: &Arc<Task>) -> Vec<f64> {
        let scene =
            draw_scene(&paper_robot(), task, &SceneSettings::default(), &mut stream(3, "reward test", 0)).expect("a scene");
        let mut monitor = Monitor::new(&scene);
        let start = scene.objects[0].pose.position_m;
        let target = scene.target_m(0);
        let above = |at: [f64; 3], by: f64| [at[0], at[1], at[2] + by];
        let halfway: [f64; 3] = std::array::from_fn(|i| (above(start, 0.1)[i] + above(target, 0.03)[i]) / 2.0);
        let released = task.goals[0].kind().releases();
        let mut moments = vec![(start, 0.3, false), (start, 0.02, false), (start, 0.0, true), (halfway, 0.0, true)];
        moments.extend([(target, 0.0, true); 2]);
        moments.extend([(target, if released { 0.1 } else { 0.0 }, !released); 10]);
        let rewards = moments.into_iter().map(|(block, away, gripped)| {
            let seen = seen(&scene, block, away, gripped);
            let verdict = monitor.update(&seen);
            dense(&scene, &seen, &verdict, GAMMA)
        });
        rewards.collect()
    }

    #[test]
    fn every_stage_earns_more_than_the_one_before_within_the_bounds() {
        for task in &of_the_paper() {
            let earned = earned(task);
            assert!(earned.windows(2).all(|pair| pair[0] <= pair[1] + 1e-12), "{task}: {earned:?}");
            assert!(earned[..5].windows(2).all(|pair| pair[0] + 0.01 < pair[1]), "{task}: {earned:?}");
            let solved = earned.iter().position(|r| *r > 1.0).expect("solved");
            assert!(earned[..solved].iter().all(|r| (0.0..=1.0).contains(r)), "{task}: {earned:?}");
            assert!((earned[solved] - 1.0 - 1.0 / (1.0 - GAMMA)).abs() < 1e-9, "{task}: {earned:?}");
        }
    }
}
