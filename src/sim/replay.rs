//! Executing recorded commands again, without looking: new disturbances carry the arm where the demo never was.

use super::disturbance::Disturbance;
use super::episode::{Controller, run_episode};
use crate::config::{SceneSettings, SimulateSettings};
use crate::demo::{Demo, Episode};
use crate::error::Result;
use crate::interrupt::Interrupt;
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

/// Runs the commands of `demo` from its start under disturbances drawn from `rng`, for as many steps as the demo has. Friction and
/// mass are drawn anew and obstacles taken from the settings: a dataset does not hold them.
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub fn reexecute(
    index: u64,
    demo: &Demo,
    scene: &SceneSettings,
    settings: &SimulateSettings,
    mut rng: ChaCha8Rng,
    interrupt: &Interrupt,
) -> Result<Episode> {
    let start = State::from_row(demo.task(), demo.state(0)).expect("a demo's rows have its task's length");
    let scene = Scene {
        task: demo.task(),
        block: start.block,
        context: start.context,
        obstacles: scene.obstacles.clone(),
        friction: scene.friction.draw(&mut rng),
        block_mass_kg: scene.block_mass_kg.draw(&mut rng),
    };
    let mut replay = Replay { commands: demo.actions().chunks_exact(JOINTS) };
    let steps = u32::try_from(demo.len()).unwrap_or(u32::MAX);
    run_episode(index, &scene, &mut replay, &mut Disturbance::new(settings, rng), steps, interrupt)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::PulseSettings;
    use crate::math::sin_cos;
    use crate::scene::Obstacle;
    use crate::seed::stream;
    use crate::sim::World;
    use crate::tasks::{FailureClass, Task, draw_scene};

    #[test]
    fn commands_without_noise_lead_where_they_led_and_with_noise_elsewhere() {
        let settings = SceneSettings::default();
        let scene = draw_scene(Task::Stack, &settings, &mut stream(3, "scene", 0)).expect("there is room");
        let mut world = World::new(&scene);
        let mut states = world.observe().state.to_row();
        let actions: Vec<f32> =
            (0..15).flat_map(|t| (0..JOINTS).map(move |i| 0.2 * sin_cos((t + i) as f64 / 3.0).0 as f32)).collect();
        for action in actions.chunks_exact(JOINTS) {
            world.step(&std::array::from_fn(|i| f64::from(action[i])));
            states.extend(world.observe().state.to_row());
        }
        let demo = Demo::new(Task::Stack, states, actions.clone(), actions).expect("lengths match");
        let again = |noise_variance: f64| {
            let off = PulseSettings { probability: 0.0, ..PulseSettings::default() };
            let noise = SimulateSettings { noise_variance, pulses: off, ..SimulateSettings::default() };
            let episode = reexecute(0, &demo, &settings, &noise, stream(4, "noise", 0), &Interrupt::default());
            let episode = episode.expect("not interrupted");
            let states = episode.to_demo().expect("a demo").states().to_vec();
            states.iter().zip(demo.states()).map(|(a, b)| (a - b).abs()).fold(0.0f32, f32::max)
        };
        assert!(again(0.0) < 1e-5, "{}", again(0.0));
        assert!(again(0.001) > 1e-3, "{}", again(0.001));
    }

    #[test]
    fn a_demo_whose_execution_breaks_down_is_no_panic() {
        let touching = Obstacle { center_m: [0.0, 0.0, 0.3], size_m: [0.02; 3] };
        let settings = SceneSettings { obstacles: vec![touching], ..SceneSettings::default() };
        let scene = draw_scene(Task::PickUp, &SceneSettings::default(), &mut stream(3, "scene", 0)).expect("there is room");
        let start = World::new(&scene).observe().state.to_row();
        const STEPS: usize = 100;
        let (states, still) = (start.repeat(STEPS + 1), vec![0.0; STEPS * JOINTS]);
        let demo = Demo::new(Task::PickUp, states, still.clone(), still).expect("lengths match");
        let episode = reexecute(0, &demo, &settings, &SimulateSettings::default(), stream(4, "noise", 0), &Interrupt::default());
        assert_eq!(episode.expect("no error").failure, Some(FailureClass::SimulationBrokeDown));
    }
}
