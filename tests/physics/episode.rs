//! The episode loop: noise on what is executed, pulses at their rate, ends and records that hold.

use crate::scene;
use crate::scripted::Script;
use hilt::config::{PulseSettings, SimulateSettings};
use hilt::demo::Episode;
use hilt::error::Error;
use hilt::interrupt::Interrupt;
use hilt::joints::Joints;
use hilt::robot::file::built_in::paper_robot;
use hilt::scene::{Obstacle, Placed, Scene};
use hilt::sim::{Controller, Disturbance, run_episode};
use hilt::state::{Action, Pose};
use hilt::task::built_in::{of_the_paper, pick_up};
use hilt::tasks::{FailureClass, Observation};

/// No command of the Jaco.
fn still() -> Action {
    Joints::zeros(9)
}

/// Always asks for the same.
struct Constant(Action);

impl Controller for Constant {
    fn command(&mut self, _seen: &Observation) -> Action {
        self.0
    }
}

fn disturbance(settings: &SimulateSettings, index: u64) -> Disturbance {
    Disturbance::new(&paper_robot(), settings, hilt::seed::stream(5, "simulate", index))
}

fn run(scene: &Scene, controller: &mut dyn Controller, index: u64, max_steps: u32) -> Episode {
    let mut disturbance = disturbance(&SimulateSettings::default(), index);
    run_episode(index, scene, controller, &mut disturbance, max_steps, &Interrupt::default()).expect("not interrupted")
}

/// The figure of merit of the scripted grasp under noise; the bound leaves room for the script, which is no planner.
#[test]
fn noisy_episodes_of_all_tasks_succeed() {
    for task in of_the_paper() {
        let count = 20;
        let solved = (0..count).filter(|i| {
            let scene = scene(&task, *i);
            let block = &scene.objects[0].pose;
            let mut script = if task == pick_up() { Script::lift(block) } else { Script::carry(block, scene.target_m(0)) };
            run(&scene, &mut script, *i, 400).success
        });
        let solved = solved.count();
        assert!(solved >= 19, "{task}: {solved} of {count} scripted episodes succeed");
    }
}

#[test]
fn a_successful_episode_is_recorded_whole() {
    let scene = scene(&pick_up(), 0);
    let episode = run(&scene, &mut Script::lift(&scene.objects[0].pose), 0, 400);
    assert!(episode.success && episode.failure.is_none());
    let total: f64 = episode.steps.iter().chain([&episode.last]).map(|s| s.reward).sum();
    assert!((total - 1.11).abs() < 1e-12, "milestones of pick-up add up to {total}");
    assert!(episode.last.conditions.iter().all(|c| *c));
    assert_eq!(episode.last.executed, still());
    assert_eq!(episode.to_demo().expect("finite numbers").len(), episode.steps.len());
}

#[test]
fn noise_is_on_the_executed_action_only() {
    let command = Joints::from_fn(9, |i| if i < 6 { f64::from(0.01 * i as f32) } else { 0.0 });
    let episode = run(&scene(&pick_up(), 0), &mut Constant(command), 0, 400);
    let mut sum = still();
    let mut squares = still();
    for step in &episode.steps {
        assert_eq!(step.commanded, command);
        for i in 0..9 {
            let noise = step.executed[i] - command[i];
            sum[i] += noise;
            squares[i] += noise * noise;
            assert_eq!(f64::from(step.executed[i] as f32), step.executed[i], "executed actions are f32 numbers");
        }
    }
    let n = episode.steps.len() as f64;
    assert_eq!(n, 400.0);
    for i in 0..9 {
        // Three standard errors of a mean and of a variance over 400 draws.
        assert!((sum[i] / n).abs() < 3.5 * (0.001f64 / n).sqrt(), "joint {i}: mean {}", sum[i] / n);
        assert!((squares[i] / n - 0.001).abs() < 3.5 * 0.001 * (2.0 / n).sqrt(), "joint {i}: variance {}", squares[i] / n);
    }
}

#[test]
fn executed_actions_stay_within_the_velocity_limits() {
    let mut noise = disturbance(&SimulateSettings::default(), 1);
    for _ in 0..100 {
        let robot = paper_robot();
        let limits: Joints = robot.joints.iter().map(|joint| joint.velocity).collect();
        for (v, limit) in noise.apply(&limits.map(|l| 1.5 * l)).iter().zip(&limits) {
            assert!(v <= limit && *v > 0.9 * limit, "{v} rad/s against a limit of {limit}");
        }
    }
}

#[test]
fn pulses_come_at_their_rate_last_their_time_and_move_the_arm_only() {
    let pulses = PulseSettings { probability: 0.05, steps: 4, sigma_rad_s: 0.1 };
    let mut noise = disturbance(&SimulateSettings { noise_variance: 0.0, pulses, ..SimulateSettings::default() }, 0);
    let count = 20_000;
    let actions: Vec<Action> = (0..count).map(|_| noise.apply(&still())).collect();
    let pushed = actions.iter().filter(|a| a[0] != 0.0).count() as f64 / f64::from(count);
    // A pulse of 4 steps after 0.95 / 0.05 quiet steps on average.
    let expected = 4.0 / (4.0 + 0.95 / 0.05);
    assert!((pushed - expected).abs() < 0.02, "{pushed} of the steps are pushed, expected {expected}");
    assert!(actions.iter().all(|a| a[6..].iter().all(|v| *v == 0.0)), "a pulse moved a finger");
    let changes = actions.windows(2).filter(|w| w[0] != w[1] && w[1][0] != 0.0).count() as f64;
    assert!((changes * 4.0 / f64::from(count) - pushed).abs() < 0.01, "pulses last four steps");
    let quiet = disturbance(&SimulateSettings { noise_variance: 0.0, ..SimulateSettings::default() }, 0).apply(&still());
    assert_eq!(quiet, still());
}

#[test]
fn an_idle_arm_never_reaches_and_a_fallen_block_ends_the_episode() {
    let mut scene = scene(&pick_up(), 0);
    let idle = run(&scene, &mut Constant(still()), 0, 50);
    assert_eq!((idle.steps.len(), idle.success, idle.failure), (50, false, Some(FailureClass::NeverReached)));
    scene.objects[0].pose.position_m = [3.0, 0.0, 0.5];
    let fallen = run(&scene, &mut Constant(still()), 0, 200);
    assert!(fallen.steps.len() < 20, "a block that falls past the table ends the episode, not {} steps", fallen.steps.len());
}

#[test]
fn a_command_that_is_no_number_ends_the_episode_unrecorded() {
    struct Breaks(u32);
    impl Controller for Breaks {
        fn command(&mut self, _seen: &Observation) -> Action {
            self.0 += 1;
            if self.0 > 5 { [f64::NAN; 9].into() } else { still() }
        }
    }
    let episode = run(&scene(&pick_up(), 0), &mut Breaks(0), 0, 50);
    assert_eq!(episode.steps.len(), 5);
    assert!(!episode.success);
    episode.to_demo().expect("only finite numbers are recorded");
}

/// A box that touches the arm at rest, a block too light for single precision, numbers beyond it: the physics engine panics or ends in
/// numbers that are none.
#[test]
fn an_episode_whose_simulation_breaks_down_is_a_failure_of_its_own_class_and_no_panic() {
    let plain = scene(&pick_up(), 0);
    let touching = Obstacle { center_m: [0.0, 0.0, 0.3], size_m: [0.02; 3] };
    let block = plain.objects[0];
    let with = |block: Placed| Scene { objects: vec![block], ..plain.clone() };
    let harmed = [
        Scene { obstacles: vec![touching], ..plain.clone() },
        with(Placed { mass_kg: 1e-21, ..block }),
        with(Placed { pose: Pose { position_m: [1e300, 0.0, 0.025], ..block.pose }, ..block }),
        with(Placed { pose: Pose { quaternion_xyzw: [0.0; 4], ..block.pose }, ..block }),
        Scene { obstacles: vec![Obstacle { center_m: [1e39; 3], size_m: [1e300; 3] }], ..plain.clone() },
        with(Placed { friction: f64::NAN, mass_kg: f64::INFINITY, ..block }),
        with(Placed { mass_kg: -1.0, ..block }),
    ];
    for (number, scene) in harmed.iter().enumerate() {
        let episode = run(scene, &mut Script::lift(&scene.objects[0].pose), 0, 100);
        let finite = episode.steps.iter().all(|s| s.state.to_row().iter().all(|v| v.is_finite()));
        assert!(!episode.success && finite && episode.steps.len() <= 100, "scene {number}");
        if number == 0 {
            assert_eq!(episode.failure, Some(FailureClass::SimulationBrokeDown));
        }
    }
    assert_eq!(FailureClass::SimulationBrokeDown.name(), "simulation_broke_down");
}

#[test]
fn a_command_that_is_no_number_is_a_failure_of_its_own_class() {
    let scene = scene(&pick_up(), 0);
    for bad in [f64::NAN, f64::INFINITY, 1e300] {
        let episode = run(&scene, &mut Constant(Joints::from_fn(9, |i| if i == 3 { bad } else { 0.0 })), 0, 50);
        assert_eq!((episode.failure, episode.steps.len()), (Some(FailureClass::CommandNotFinite), 0), "{bad}");
    }
}

#[test]
fn an_interrupt_ends_an_episode_within_a_step() {
    let (scene, interrupt) = (scene(&pick_up(), 0), Interrupt::default());
    interrupt.raise(2);
    let mut noise = disturbance(&SimulateSettings::default(), 0);
    let ended = run_episode(0, &scene, &mut Constant(still()), &mut noise, 10_000, &interrupt);
    assert!(matches!(ended, Err(Error::Interrupted)));
}
