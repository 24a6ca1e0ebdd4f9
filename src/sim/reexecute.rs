//! Executing recorded commands again, without looking: new disturbances carry the arm where the demo never was.

use super::disturbance::Disturbance;
use super::episode::{Controller, run_episode};
use crate::config::{FingerPulses, SceneSettings, SimulateSettings};
use crate::demo::{Demo, Episode};
use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::joints::Joints;
use crate::pulse::Pulse;
use crate::robot::Robot;
use crate::seed::stream;
use crate::state::{Action, State};
use crate::tasks::{Observation, Task, scene_of};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;

/// Plays a demo's commands, then stands still.
struct Replay<'a> {
    robot: &'a Robot,
    commands: std::slice::ChunksExact<'a, f32>,
    fingers: Option<Excitation<'a>>,
}

impl Controller for Replay<'_> {
    fn command(&mut self, _seen: &Observation) -> Action {
        let still = Joints::zeros(self.robot.joints.len());
        let mut command: Action = self.commands.next().map_or(still, |c| c.iter().map(|v| f64::from(*v)).collect());
        if let Some(speeds) = self.fingers.as_mut().and_then(Excitation::advance) {
            let fingers = &self.robot.joints[self.robot.arm..];
            let scaled = speeds.iter().zip(fingers).map(|(speed, joint)| speed * joint.per_radian());
            command[self.robot.arm..].iter_mut().zip(scaled).for_each(|(command, speed)| *command = speed);
        }
        command
    }
}

/// The fingers' own commands, now and then.
struct Excitation<'a> {
    settings: &'a FingerPulses,
    rng: ChaCha8Rng,
    pulse: Pulse,
}

impl Excitation<'_> {
    /// The next control step's commands \[rad/s\], unless they are the demo's.
    fn advance(&mut self) -> Option<&[f64]> {
        let FingerPulses { probability, steps, speed_rad_s } = *self.settings;
        self.pulse.next((probability, steps), &mut self.rng, |rng| speed_rad_s * (2.0 * rng.random::<f64>() - 1.0))
    }
}

/// Runs the commands of a demo of a robot in a task from its start under disturbances drawn from `rng`, for as many steps as the demo has, now and then with
/// other commands for the `fingers`. Friction and mass are drawn anew and obstacles taken from the settings: a dataset does not hold them.
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub fn reexecute(
    index: u64,
    (robot, task, demo): (&Arc<Robot>, &Arc<Task>, &Demo),
    scene: &SceneSettings,
    settings: &SimulateSettings,
    fingers: &FingerPulses,
    mut rng: ChaCha8Rng,
    interrupt: &Interrupt,
) -> Result<Episode> {
    let start = State::from_row(task, robot.joints.len(), demo.state(0)).expect("a demo of the task has rows of its length");
    let scene = scene_of((robot, task), scene, (start.objects, start.goals), &mut rng);
    let excitation = || {
        let rng = stream(rng.random(), "reexecute.fingers", index);
        Excitation { settings: fingers, rng, pulse: Pulse::new(robot.fingers().len()) }
    };
    let fingers = (fingers.probability > 0.0).then(excitation);
    let mut replay = Replay { robot, commands: demo.actions().chunks_exact(robot.joints.len()), fingers };
    let steps = u32::try_from(demo.len()).unwrap_or(u32::MAX);
    run_episode(index, &scene, &mut replay, &mut Disturbance::new(robot, settings, rng), steps, interrupt)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::PulseSettings;
    use crate::math::sin_cos;
    use crate::robot::file::built_in::paper_robot;
    use crate::scene::Obstacle;
    use crate::sim::World;
    use crate::task::built_in::{pick_up, stack};
    use crate::tasks::{FailureClass, draw_scene};

    /// Joints of the paper's robot, and of its arm.
    const DIM: usize = 9;
    const ARM: usize = 6;

    #[test]
    fn commands_without_noise_lead_where_they_led_and_with_noise_elsewhere() {
        let settings = SceneSettings::default();
        let scene = draw_scene(&paper_robot(), &stack(), &settings, &mut stream(3, "scene", 0)).expect("there is room");
        let mut world = World::new(&scene);
        let mut states = world.observe().state.to_row();
        let actions: Vec<f32> =
            (0..15).flat_map(|t| (0..DIM).map(move |i| 0.2 * sin_cos((t + i) as f64 / 3.0).0 as f32)).collect();
        for action in actions.chunks_exact(DIM) {
            world.step(&action.iter().map(|v| f64::from(*v)).collect());
            states.extend(world.observe().state.to_row());
        }
        let demo = Demo::new(&stack().layout(&paper_robot()), states, actions.clone(), actions).expect("lengths match");
        let again = |noise_variance: f64| {
            let off = PulseSettings { probability: 0.0, ..PulseSettings::default() };
            let noise = SimulateSettings { noise_variance, pulses: off, ..SimulateSettings::default() };
            let episode = reexecute(
                0,
                (&paper_robot(), &stack(), &demo),
                &settings,
                &noise,
                &FingerPulses::default(),
                stream(4, "noise", 0),
                &Interrupt::default(),
            );
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
        let scene =
            draw_scene(&paper_robot(), &pick_up(), &SceneSettings::default(), &mut stream(3, "scene", 0)).expect("there is room");
        let start = World::new(&scene).observe().state.to_row();
        const STEPS: usize = 100;
        let (states, still) = (start.repeat(STEPS + 1), vec![0.0; STEPS * DIM]);
        let demo = Demo::new(&pick_up().layout(&paper_robot()), states, still.clone(), still).expect("lengths match");
        let episode = reexecute(
            0,
            (&paper_robot(), &pick_up(), &demo),
            &settings,
            &SimulateSettings::default(),
            &FingerPulses::default(),
            stream(4, "noise", 0),
            &Interrupt::default(),
        );
        assert_eq!(episode.expect("no error").failure, Some(FailureClass::SimulationBrokeDown));
    }

    #[test]
    fn excited_fingers_get_other_commands_and_the_arm_the_demos() {
        let settings = SceneSettings::default();
        let scene = draw_scene(&paper_robot(), &pick_up(), &settings, &mut stream(3, "scene", 0)).expect("there is room");
        const STEPS: usize = 60;
        let states = World::new(&scene).observe().state.to_row().repeat(STEPS + 1);
        let actions: Vec<f32> = (0..STEPS * DIM).map(|i| 0.01 * (i % DIM) as f32).collect();
        let demo = Demo::new(&pick_up().layout(&paper_robot()), states, actions.clone(), actions.clone()).expect("lengths match");
        let executed = |fingers: &FingerPulses, index: u64| -> Vec<f32> {
            let noise = SimulateSettings { noise_variance: 0.0, ..SimulateSettings::default() };
            let episode = reexecute(
                index,
                (&paper_robot(), &pick_up(), &demo),
                &settings,
                &noise,
                fingers,
                stream(4, "noise", 0),
                &Interrupt::default(),
            );
            episode.expect("not interrupted").to_demo().expect("a demo").executed().to_vec()
        };
        assert_eq!(executed(&FingerPulses::default(), 0), actions);
        let fingers = FingerPulses { probability: 0.2, ..FingerPulses::default() };
        let (excited, mut changed) = (executed(&fingers, 0), 0);
        for (excited, demo) in excited.chunks(DIM).zip(actions.chunks(DIM)) {
            assert_eq!(excited[..ARM], demo[..ARM]);
            assert!(excited[ARM..].iter().all(|speed| speed.abs() <= fingers.speed_rad_s as f32), "{excited:?}");
            changed += usize::from(excited[ARM..] != demo[ARM..]);
        }
        // A pulse of three steps begins in a fifth of the steps outside of one.
        assert!((STEPS / 8..STEPS * 3 / 4).contains(&changed), "{changed} of {STEPS} steps");
        assert_eq!(excited, executed(&fingers, 0));
        assert_ne!(excited, executed(&fingers, 1));
    }
}
