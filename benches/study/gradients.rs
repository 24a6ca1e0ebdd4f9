//! State cloning through the true simulator against state cloning through the network: how the state three steps later answers to a
//! change of the action now. The simulator's answer comes from finite differences around a recorded demo.

use super::Args;
use anyhow::{Context, Result, anyhow};
use hilt::data::{recording, weights};
use hilt::demo::{Episode, Phase};
use hilt::learn::Dynamics;
use hilt::report::table::text_table;
use hilt::sim::World;
use hilt::state::Action;
use hilt::tasks::with_layout;
use std::ops::Range;
use std::path::Path;

/// Joints of the Jaco, and of its arm.
const JOINTS: usize = 9;
const ARM_JOINTS: usize = 6;
/// Steps from the action to the state that answers.
const STEPS: usize = 3;
/// Change of the action \[rad/s\]: the noise of the demos, large enough to move a finger against its friction.
const CHANGE_RAD_S: f64 = 0.1;
/// Every so many steps of a recording one is looked at.
const STRIDE: usize = 5;

/// Which entries of the state answer to which entries of the action.
const PAIRS: [(&str, Range<usize>, Range<usize>); 4] = [
    ("arm -> arm", 0..ARM_JOINTS, 0..ARM_JOINTS),
    ("fingers -> fingers", ARM_JOINTS..JOINTS, ARM_JOINTS..JOINTS),
    ("arm -> block", 0..ARM_JOINTS, 2 * JOINTS..2 * JOINTS + 3),
    ("fingers -> block", ARM_JOINTS..JOINTS, 2 * JOINTS..2 * JOINTS + 3),
];

/// Inner products of the two answers, summed over steps and entries.
#[derive(Clone, Copy, Default)]
struct Products {
    network: f64,
    simulator: f64,
    both: f64,
}

/// Prints gain and cosine of the network's answer to the simulator's, per phase and group.
pub fn run(args: &Args) -> Result<()> {
    let (recordings, dynamics) = (args.recordings.as_deref(), args.dynamics.as_deref());
    let (recordings, dynamics) = recordings.zip(dynamics).context("give --recordings DIR and --dynamics FILE of one run")?;
    let (tensors, meta, _) = weights::read(dynamics, "dynamics")?;
    let dynamics = Dynamics::from_tensors(&tensors, &with_layout(meta)).map_err(|why| anyhow!(why))?;
    let mut sums = [[Products::default(); PAIRS.len()]; Phase::ALL.len()];
    for index in 0..args.episodes.min(20) {
        let path = recordings.join(recording::file_name(index));
        if path.exists() {
            look(&path, &dynamics, &mut sums)?;
        }
    }
    let mut rows = Vec::new();
    for (phase, sums) in Phase::ALL.iter().zip(&sums) {
        for ((name, ..), p) in PAIRS.iter().zip(sums) {
            let cosine = p.both / (p.network * p.simulator).sqrt();
            rows.push(vec![
                phase.name().to_string(),
                (*name).to_string(),
                format!("{:.2}", p.both / p.simulator),
                format!("{cosine:.2}"),
            ]);
        }
    }
    print!("{}", text_table(&["phase", "action -> state", "gain", "cosine"], &rows));
    Ok(())
}

fn look(path: &Path, dynamics: &Dynamics, sums: &mut [[Products; PAIRS.len()]]) -> Result<()> {
    let (episode, _) = recording::read(path)?;
    let mut world = World::new(&episode.scene);
    for (t, step) in episode.steps.iter().enumerate() {
        if let (true, Some(phase)) = (t % STRIDE == 0 && t + STEPS < episode.steps.len(), step.phase) {
            let start = world.snapshot();
            for joint in 0..JOINTS {
                let network = answer(joint, &step.executed, |action| Ok(predicted(dynamics, &episode, t, action)))?;
                let simulator = answer(joint, &step.executed, |action| simulated(&start, &episode, t, action))?;
                add(&mut sums[phase as usize], joint, &network, &simulator);
            }
        }
        world.step(&step.executed);
    }
    Ok(())
}

/// Derivative of the state `STEPS` later with respect to one entry of the action.
fn answer(joint: usize, executed: &Action, state_after: impl Fn(&Action) -> Result<Vec<f64>>) -> Result<Vec<f64>> {
    let changed = |by: f64| {
        let mut action = *executed;
        action[joint] += by;
        state_after(&action)
    };
    let (up, down) = (changed(CHANGE_RAD_S)?, changed(-CHANGE_RAD_S)?);
    Ok(up.iter().zip(&down).map(|(u, d)| (u - d) / (2.0 * CHANGE_RAD_S)).collect())
}

/// The state after `action` and the recorded actions that follow, by the network.
fn predicted(dynamics: &Dynamics, episode: &Episode, t: usize, action: &Action) -> Vec<f64> {
    let single = |action: &Action| action.iter().map(|v| *v as f32).collect::<Vec<f32>>();
    let mut state = dynamics.predict(&episode.steps[t].state.to_row(), &single(action));
    for step in &episode.steps[t + 1..t + STEPS] {
        state = dynamics.predict(&state, &single(&step.executed));
    }
    state.iter().map(|v| f64::from(*v)).collect()
}

/// The same in the simulator, from a snapshot of step `t`.
fn simulated(start: &[u8], episode: &Episode, t: usize, action: &Action) -> Result<Vec<f64>> {
    let mut world = World::restore(start)?;
    world.step(action);
    episode.steps[t + 1..t + STEPS].iter().for_each(|step| world.step(&step.executed));
    Ok(world.observe().state.to_row().iter().map(|v| f64::from(*v)).collect())
}

fn add(sums: &mut [Products], joint: usize, network: &[f64], simulator: &[f64]) {
    for (sum, (_, _, entries)) in sums.iter_mut().zip(&PAIRS).filter(|(_, pair)| pair.1.contains(&joint)) {
        for (n, s) in network[entries.clone()].iter().zip(&simulator[entries.clone()]) {
            sum.network += n * n;
            sum.simulator += s * s;
            sum.both += n * s;
        }
    }
}
