//! An episode: controller, disturbance and world in a loop, watched by the task's monitor.

use super::disturbance::Disturbance;
use super::world::World;
use crate::demo::{Episode, Phase, Step};
use crate::scene::Scene;
use crate::state::{Action, JOINTS};
use crate::tasks::{Monitor, Observation, Verdict};

/// Decides the command of each control step: the plan follower, or a learned policy.
pub trait Controller {
    /// Joint velocities to ask for \[rad/s\], given what is seen.
    fn command(&mut self, seen: &Observation) -> Action;

    /// The part of the plan that the last command belongs to, if there is a plan.
    fn phase(&self) -> Option<Phase> {
        None
    }
}

/// Runs one episode until success (its last 0.5 s is the proof), `max_steps`, a block below the table, or a number that is not finite.
/// A moment or a command that is not finite is left out of the record.
pub fn run_episode(
    index: u64,
    scene: &Scene,
    controller: &mut dyn Controller,
    disturbance: &mut Disturbance,
    max_steps: u32,
) -> Episode {
    let mut world = World::new(scene);
    let mut monitor = Monitor::new(scene);
    let mut steps: Vec<Step> = Vec::new();
    let mut seen = world.observe();
    let mut verdict = monitor.update(&seen);
    while !verdict.success && steps.len() < max_steps as usize && !fallen(&seen) {
        let commanded = controller.command(&seen).map(|v| f64::from(v as f32));
        if commanded.iter().any(|v| !v.is_finite()) {
            break;
        }
        let executed = disturbance.apply(&commanded);
        world.step(&executed);
        let next = world.observe();
        if !finite(&next) {
            break;
        }
        steps.push(record(&seen, &verdict, commanded, executed, controller.phase()));
        verdict = monitor.update(&next);
        seen = next;
    }
    let success = verdict.success;
    let failure = (!success).then(|| monitor.classify(&seen));
    let last = record(&seen, &verdict, [0.0; JOINTS], [0.0; JOINTS], None);
    Episode { index, scene: scene.clone(), steps, last, success, failure }
}

fn record(seen: &Observation, verdict: &Verdict, commanded: Action, executed: Action, phase: Option<Phase>) -> Step {
    Step {
        state: seen.state,
        base_now: seen.base_now,
        commanded,
        executed,
        contacts: seen.contacts,
        block_speed_m_s: seen.block_speed_m_s,
        reward: verdict.reward,
        conditions: verdict.conditions.clone(),
        phase,
    }
}

/// Whether a block's centre is below the table's top.
fn fallen(seen: &Observation) -> bool {
    let base_height = seen.base_now.map_or(f64::INFINITY, |b| b.position_m[2]);
    seen.state.block.position_m[2].min(base_height) < 0.0
}

fn finite(seen: &Observation) -> bool {
    let state = &seen.state;
    let base = seen.base_now.map_or([0.0; 7], |b| b.to_array());
    let all = state.q_rad.iter().chain(&state.dq_rad_s).chain(&seen.contacts.finger_block_n);
    all.copied().chain(state.block.to_array()).chain(base).chain([seen.block_speed_m_s]).all(f64::is_finite)
}
