//! What the dynamics network expected, some steps before, of every moment.

use crate::demo::Episode;
use crate::learn::Dynamics;
use crate::state::{Pose, State};
use rayon::prelude::*;

/// Of each moment t: positions of the joints and a pose of each object as the network has them after open loop from the recorded state of `ahead` steps
/// before (at the start of the episode, from its first) with the commands that were executed.
#[derive(Clone, Debug, PartialEq)]
pub struct Ghost {
    /// Steps that were predicted.
    pub ahead: usize,
    /// A row a moment.
    pub rows: Vec<Vec<f64>>,
}

impl Ghost {
    /// By a network of the episode's robot and task.
    pub fn new(episode: &Episode, dynamics: &Dynamics, ahead: usize) -> Self {
        let states: Vec<Vec<f32>> = episode.moments().map(|step| step.state.to_row()).collect();
        let executed: Vec<Vec<f32>> =
            episode.steps.iter().map(|step| step.executed.iter().map(|v| *v as f32).collect()).collect();
        let expected = |t: usize| {
            let from = t.saturating_sub(ahead);
            executed[from..t].iter().fold(states[from].clone(), |state, action| {
                let next = dynamics.predict(&state, action);
                // A network that runs away is shown where it was last.
                if next.iter().all(|v| v.is_finite()) { next } else { state }
            })
        };
        Ghost { ahead, rows: (0..states.len()).into_par_iter().map(|t| row(episode, t, &expected(t))).collect() }
    }
}

/// What goals move is where the network has it, everything else where it is.
fn row(episode: &Episode, t: usize, expected: &[f32]) -> Vec<f64> {
    let (robot, task) = (&episode.scene.robot, &episode.scene.task);
    let state = State::from_row(task, robot.joints.len(), expected).expect("a network of the task has rows of its length");
    let now = &episode.steps.get(t).unwrap_or(&episode.last).objects;
    let pose = |i: usize| if i < task.moved() { state.objects[i] } else { now[i].pose };
    let poses = (0..task.objects.len()).flat_map(|i| turned(pose(i)).to_array());
    state.q.iter().copied().chain(poses).collect()
}

/// Its quaternion has left unit length along the way.
fn turned(pose: Pose) -> Pose {
    Pose { quaternion_xyzw: pose.isometry().rotation.coords.into(), ..pose }
}
