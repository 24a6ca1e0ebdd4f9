//! Executing recorded commands again, without looking: new disturbances carry the arm where the demo never was.

use super::disturbance::Disturbance;
use super::episode::{Controller, run_episode};
use crate::config::{SceneSettings, SimulateSettings};
use crate::demo::{Demo, Episode};
use crate::scene::Scene;
use crate::state::{Action, JOINTS, State};
use crate::tasks::Observation;
use rand_chacha::ChaCha8Rng;

/// Plays a demo's commands, then stands still.
struct Replay<'a> {
    commands: std::slice::ChunksExact<'a, f32>,
}

impl Controller for Replay<'_> {
    fn command(&mut self, _seen: &Observation) -> Action {
        self.commands.next().map_or([0.0; JOINTS], |command| std::array::from_fn(|i| f64::from(command[i])))
    }
}

/// Runs the commands of `demo` from its start under disturbances drawn from `rng`, for as many steps as the demo has. Friction, mass
/// and obstacles are those of the settings: a dataset does not hold them.
pub fn reexecute(index: u64, demo: &Demo, scene: &SceneSettings, settings: &SimulateSettings, rng: ChaCha8Rng) -> Episode {
    let start = State::from_row(demo.task(), demo.state(0)).expect("a demo's rows have its task's length");
    let scene = Scene {
        task: demo.task(),
        block: start.block,
        context: start.context,
        obstacles: scene.obstacles.clone(),
        friction: scene.friction,
        block_mass_kg: scene.block_mass_kg,
    };
    let mut replay = Replay { commands: demo.actions().chunks_exact(JOINTS) };
    let steps = u32::try_from(demo.len()).unwrap_or(u32::MAX);
    run_episode(index, &scene, &mut replay, &mut Disturbance::new(settings, rng), steps)
}
