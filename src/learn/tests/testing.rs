//! Toy demos for tests: a frictionless arm whose joints turn towards angles that depend on the block, with noise on the commands.

use crate::demo::Demo;
use crate::robot::READY_Q_RAD;
use crate::seed::stream;
use crate::state::{BASE_DIM, CONTROL_DT_S, JOINTS};
use crate::task::Task;
use rand::{Rng, RngExt};

fn noise(rng: &mut impl Rng, size: f32) -> f32 {
    size * (2.0 * rng.random::<f32>() - 1.0)
}

fn first_state(task: Task, rng: &mut impl Rng) -> Vec<f32> {
    let mut state = vec![0.0f32; task.state_dim()];
    (0..JOINTS).for_each(|i| state[i] = READY_Q_RAD[i] as f32 + noise(rng, 0.05));
    let block = [0.47 + noise(rng, 0.15), noise(rng, 0.15), 0.025, noise(rng, 0.01), noise(rng, 0.01), 0.0, 1.0];
    state[2 * JOINTS..BASE_DIM].copy_from_slice(&block);
    let goal = [0.47 + noise(rng, 0.15), noise(rng, 0.15), 0.025, 0.0, 0.0, 0.0, 1.0];
    let extra = task.state_dim() - BASE_DIM;
    state[BASE_DIM..].copy_from_slice(&goal[..extra]);
    state
}

/// `rows` states around the start, with random velocities.
pub fn random_states(task: Task, rows: usize, seed: u64) -> Vec<f32> {
    let mut rng = stream(seed, "toy-states", 0);
    let mut states = Vec::new();
    for _ in 0..rows {
        let mut state = first_state(task, &mut rng);
        (JOINTS..2 * JOINTS).for_each(|i| state[i] = noise(&mut rng, 0.5));
        states.extend(state);
    }
    states
}

/// One toy demo of `steps` actions.
pub fn demo(task: Task, steps: usize, seed: u64) -> Demo {
    let mut rng = stream(seed, "toy-demo", 0);
    let mut state = first_state(task, &mut rng);
    let (mut states, mut actions, mut executed) = (state.clone(), Vec::new(), Vec::new());
    for _ in 0..steps {
        for i in 0..JOINTS {
            let target = READY_Q_RAD[i] as f32 + 0.8 * state[18 + i % 2] - 0.2;
            let command = (2.0 * (target - state[i])).clamp(-0.6, 0.6);
            let given = command + noise(&mut rng, 0.05);
            actions.push(command);
            executed.push(given);
            state[i] += CONTROL_DT_S as f32 * given;
            state[JOINTS + i] = given;
        }
        state[18] += 0.002 * state[JOINTS];
        states.extend(&state);
    }
    Demo::new(task, states, actions, executed).expect("a toy demo has matching lengths")
}

/// `count` toy demos of slightly different lengths.
pub fn demos(task: Task, count: usize, steps: usize, seed: u64) -> Vec<Demo> {
    (0..count).map(|i| demo(task, steps + i % 3, seed + i as u64)).collect()
}
