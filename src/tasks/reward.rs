//! The dense reward: how far a task has come, in every step. It is not the paper's, whose milestones ([`super::Monitor`]) say nothing on
//! the way to them; it exists so that reinforcement learning gets a fair chance. Its stages are those of ManiSkill's PickCube and
//! StackCube, fitted to a hand with three fingers:
//!
//! | task | before the grasp | gripped | where the task wants it |
//! |---|---|---|---|
//! | all | 2 near(tool to block) + 1.5 around(tool to block) closed | | |
//! | pick-up | | 4 + 3 near(height still to rise) | 8: at height, gripped |
//! | pick-and-place, stack | | 4 + near(block to target) | 6 + opened + still |
//!
//! over 8, so that a step earns at most 1; near(d) = 1 - tanh(d / 20 cm), around(d) = 1 - tanh(d / 3 cm). The fingers are driven by their
//! velocities, and noise alone hardly ever closes two of them: the way there is paid too. An episode ends with success, which must not
//! cost what standing there for ever would earn: the step that solves the task earns 1 / (1 - gamma) besides.

use super::observation::Observation;
use super::{Task, Verdict, pick_up};
use crate::math::tanh;
use crate::robot::Robot;
use crate::scene::Scene;

/// What the best step short of success earns before it is scaled to 1.
const MOST: f64 = 8.0;
/// Distances are told apart within this \[m\]: near(d) is 1/2 at 11 cm.
const NEAR_M: f64 = 0.2;
/// The fingers are around the block when the tool point is within this of its centre \[m\]; above the block it is not.
const AROUND_M: f64 = 0.03;
/// Speeds are told apart within this \[m/s\].
const STILL_M_S: f64 = 0.1;
/// Positions of the conditions `lifted` and, after it, of what the task wants in `task.condition_names()`.
const LIFTED: usize = 2;

/// Reward of the step that led to `seen`, between 0 and 1, or up to 1 + 1 / (1 - `gamma`) with success.
pub fn dense(scene: &Scene, seen: &Observation, verdict: &Verdict, gamma: f64) -> f64 {
    let bonus = if verdict.success { 1.0 / (1.0 - gamma) } else { 0.0 };
    stage(scene, seen, verdict) / MOST + bonus
}

fn stage(scene: &Scene, seen: &Observation, verdict: &Verdict) -> f64 {
    let at_goal = verdict.conditions[LIFTED] && verdict.conditions[LIFTED + 1];
    let gripped = seen.gripped();
    match scene.task {
        Task::PickUp if gripped => {
            let still_to_rise = (pick_up::TARGET_HEIGHT_M - seen.state.block.position_m[2]).max(0.0);
            if still_to_rise > 0.0 { 4.0 + 3.0 * near(still_to_rise, NEAR_M) } else { MOST }
        }
        Task::PickAndPlace | Task::Stack if at_goal => 6.0 + opened(seen) + still(seen),
        Task::PickAndPlace | Task::Stack if gripped => 4.0 + near(seen.block_to(scene.target_m()), NEAR_M),
        _ => {
            let away = seen.block_to(seen.tool_m);
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
fn opened(seen: &Observation) -> f64 {
    if seen.released() { 1.0 } else { 1.0 - closed(seen) }
}

/// 1 for a block at rest.
fn still(seen: &Observation) -> f64 {
    1.0 - tanh(seen.block_speed_m_s / STILL_M_S)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::SceneSettings;
    use crate::demo::Contacts;
    use crate::robot::file::built_in::paper_robot;
    use crate::seed::stream;
    use crate::state::State;
    use crate::tasks::{Monitor, draw_scene};

    const GAMMA: f64 = 0.9;

    /// The block at `block_m`, the tool `away_m` above it; gripped or not.
    fn seen(scene: &Scene, block_m: [f64; 3], away_m: f64, gripped: bool) -> Observation {
        let force = if gripped { 1.0 } else { 0.0 };
        let base_now = if let crate::state::Context::Base(base) = scene.context { Some(base) } else { None };
        let block = crate::state::Pose { position_m: block_m, ..scene.block };
        let touches = |height: f64| block_m[2] < height + 1e-6;
        Observation {
            robot: paper_robot(),
            state: State { q: [0.7; 9].into(), dq: [0.0; 9].into(), block, context: scene.context },
            tool_m: [block_m[0], block_m[1], block_m[2] + away_m],
            base_now,
            contacts: Contacts {
                finger_block_n: [force; 3].into(),
                block_table: touches(0.025),
                block_base: !touches(0.025) && touches(0.075),
                ..Contacts::none(3)
            },
            block_speed_m_s: 0.0,
        }
    }

    /// What the stages of a task earn, one after another: far, near, gripped, on the way, where it belongs, released there until solved.
    fn earned(task: Task) -> Vec<f64> {
        let scene =
            draw_scene(&paper_robot(), task, &SceneSettings::default(), &mut stream(3, "reward test", 0)).expect("a scene");
        let mut monitor = Monitor::new(&scene);
        let start = scene.block.position_m;
        let target = scene.target_m();
        let above = |at: [f64; 3], by: f64| [at[0], at[1], at[2] + by];
        let halfway: [f64; 3] = std::array::from_fn(|i| (above(start, 0.1)[i] + above(target, 0.03)[i]) / 2.0);
        let released = task != Task::PickUp;
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
        for task in Task::ALL {
            let earned = earned(task);
            assert!(earned.windows(2).all(|pair| pair[0] <= pair[1] + 1e-12), "{task}: {earned:?}");
            assert!(earned[..5].windows(2).all(|pair| pair[0] + 0.01 < pair[1]), "{task}: {earned:?}");
            let solved = earned.iter().position(|r| *r > 1.0).expect("solved");
            assert!(earned[..solved].iter().all(|r| (0.0..=1.0).contains(r)), "{task}: {earned:?}");
            assert!((earned[solved] - 1.0 - 1.0 / (1.0 - GAMMA)).abs() < 1e-9, "{task}: {earned:?}");
        }
    }
}
