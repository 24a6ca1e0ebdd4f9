//! What the simulator study measures under one setting of the physics: whole noisy episodes, held, swung and stacked blocks, speed.

#[path = "../../tests/physics/scripted.rs"]
#[allow(dead_code, reason = "the tests use more of it")]
mod scripted;

use hilt::config::{PlanSettings, SceneSettings, SimulateSettings};
use hilt::joints::Joints;
use hilt::math::sin_cos;
use hilt::plan::{Plan, Planner};
use hilt::robot::Robot;
use hilt::robot::file::built_in::paper_robot;
use hilt::scene::Scene;
use hilt::seed::stream;
use hilt::sim::{Controller, Disturbance, Follower, Physics, World};
use hilt::state::{CONTROL_DT_S, CONTROL_HZ, Pose};
use hilt::task::built_in::{pick_up, stack};
use hilt::tasks::{FailureClass, Monitor, Observation, Task, draw_scene};
use nalgebra::{Point3, Vector3};
use scripted::Script;
use std::f64::consts::TAU;
use std::fs;
use std::sync::{Arc, LazyLock};
use std::time::Instant;

/// Joints of the Jaco, and of its arm.
const JOINTS: usize = 9;
const ARM_JOINTS: usize = 6;
/// Positions and yaws of the scripted trials.
const POSITIONS: u64 = 20;
/// Control steps of 5 s.
const FIVE_SECONDS: usize = 5 * CONTROL_HZ as usize;
/// Joint 1 swings with this amplitude \[rad/s\] and period \[s\]: the hand accelerates with up to 0.6 m/s^2.
const SWING_RAD_S: f64 = 0.5;
const SWING_PERIOD_S: f64 = 2.0;
/// The fingers go on closing \[rad/s\].
const GRIP_RAD_S: f64 = 0.3;
/// Edge of the block \[m\].
const BLOCK_EDGE_M: f64 = 0.05;
/// How deep under the table the ramming script wants the tool \[m\].
const RAM_M: f64 = -0.15;

/// `count` planned scenes of a task.
pub fn plans(task: &Arc<Task>, count: u64) -> Vec<Plan> {
    let mut planner = Planner::new(&paper_robot(), task, &PlanSettings::default());
    let settings = SceneSettings::default();
    let scenes = (0..count)
        .map(|i| draw_scene(&paper_robot(), task, &settings, &mut stream(0, "scene", i)).expect("the default area has room"));
    let plan = |(i, scene)| planner.plan(i, &scene, &mut stream(0, "plan", i)).expect("every default scene has a plan");
    (0..count).zip(scenes).map(plan).collect()
}

/// How an episode ended, and after how many control steps.
pub struct End {
    pub failure: Option<FailureClass>,
    pub steps: usize,
}

/// A plan followed under noise.
pub fn episode(plan: &Plan, physics: Physics, noise_variance: f64) -> End {
    let mut follower = Follower::new(plan).expect("a whole plan");
    run(plan, &mut follower, physics, noise_variance)
}

/// The same scene by a script that looks less: what it loses, the physics let slip.
pub fn scripted_episode(plan: &Plan, physics: Physics, noise_variance: f64) -> End {
    run(plan, &mut Script::carry(&plan.scene.objects[0].pose, plan.scene.target_m(0)), physics, noise_variance)
}

fn run(plan: &Plan, controller: &mut dyn Controller, physics: Physics, noise_variance: f64) -> End {
    let settings = SimulateSettings { noise_variance, ..SimulateSettings::default() };
    let mut disturbance = Disturbance::new(&paper_robot(), &settings, stream(0, "simulate.noise", plan.index));
    let mut world = World::with(&plan.scene, physics);
    let mut monitor = Monitor::new(&plan.scene);
    let mut seen = world.observe();
    let mut steps = 0;
    while !monitor.update(&seen).success {
        if steps == settings.max_steps as usize || seen.state.objects[0].position_m[2] < 0.0 {
            return End { failure: Some(monitor.classify(&seen)), steps };
        }
        world.step(&disturbance.apply(&controller.command(&seen)));
        seen = world.observe();
        steps += 1;
    }
    End { failure: None, steps }
}

/// Processor time of this thread \[s\]; wall time where the system does not tell.
pub fn processor_s() -> f64 {
    static SINCE: LazyLock<Instant> = LazyLock::new(Instant::now);
    let text = fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let own = text.split_whitespace().next().and_then(|ns| ns.parse::<f64>().ok());
    own.map_or_else(|| SINCE.elapsed().as_secs_f64(), |ns| 1e-9 * ns)
}

/// Control steps of a plan's episode, and its processor time \[s\].
pub fn timed(plan: &Plan, physics: Physics) -> (usize, f64) {
    let start = processor_s();
    let end = episode(plan, physics, SimulateSettings::default().noise_variance);
    (end.steps, processor_s() - start)
}

/// How far things move that should not, median and largest of all positions \[m\].
pub struct Errors {
    /// The block in the hand, held still for 5 s.
    pub hold: [f64; 2],
    /// The same while the arm swings.
    pub swing: [f64; 2],
    /// A stacked block in 5 s, the arm in its ready pose.
    pub drift: [f64; 2],
    /// How deep the fingers are rammed into the table.
    pub rammed: [f64; 2],
    /// A joint of the arm from where its command leads, in one control step of free motion \[rad\].
    pub tracking: [f64; 2],
}

/// All scripted trials.
pub fn errors(physics: Physics) -> Errors {
    let settings = SceneSettings { yaw: true, ..SceneSettings::default() };
    let scene = |task: &Arc<Task>, index| {
        draw_scene(&paper_robot(), task, &settings, &mut stream(7, "study", index)).expect("the default area has room")
    };
    let of = |trial: &dyn Fn(u64) -> f64| {
        let mut all: Vec<f64> = (0..POSITIONS).map(trial).collect();
        all.sort_by(f64::total_cmp);
        [all[all.len() / 2], all[all.len() - 1]]
    };
    Errors {
        hold: of(&|i| slip(&scene(&pick_up(), i), physics, 0.0)),
        swing: of(&|i| slip(&scene(&pick_up(), i), physics, SWING_RAD_S)),
        drift: of(&|i| drift(scene(&stack(), i), physics)),
        rammed: of(&|i| rammed(&scene(&pick_up(), i), physics)),
        tracking: of(&|i| tracking(scene(&pick_up(), i), physics, i)),
    }
}

/// The block's centre as the hand sees it.
fn in_hand(arm: &Robot, seen: &Observation) -> Vector3<f64> {
    arm.tool_pose(&seen.state.q).inverse_transform_point(&Point3::from(seen.state.objects[0].position_m)).coords
}

/// Slip of a lifted block while joint 1 swings with this amplitude \[rad/s\].
fn slip(scene: &Scene, physics: Physics, swing_rad_s: f64) -> f64 {
    let (arm, mut world, mut script) = (paper_robot(), World::with(scene, physics), Script::lift(&scene.objects[0].pose));
    let mut rested = 0;
    while rested < FIVE_SECONDS / 2 {
        rested += usize::from(script.on_last_leg());
        let seen = world.observe();
        world.step(&script.command(&seen));
    }
    let before = in_hand(&arm, &world.observe());
    for step in 0..FIVE_SECONDS {
        let speed = swing_rad_s * sin_cos(TAU * step as f64 * CONTROL_DT_S / SWING_PERIOD_S).0;
        world.step(&Joints::from_fn(JOINTS, |i| {
            if i == 0 {
                speed
            } else if i < ARM_JOINTS {
                0.0
            } else {
                GRIP_RAD_S
            }
        }));
    }
    (in_hand(&arm, &world.observe()) - before).norm()
}

/// A block set on the base block.
fn drift(mut scene: Scene, physics: Physics) -> f64 {
    let [x, y, z] = scene.objects[1].pose.position_m;
    scene.objects[0].pose = Pose { position_m: [x + 0.005, y - 0.005, z + BLOCK_EDGE_M], ..scene.objects[0].pose };
    let mut world = World::with(&scene, physics);
    for _ in 0..FIVE_SECONDS {
        world.step(&Joints::zeros(JOINTS));
    }
    (Vector3::from(world.observe().state.objects[0].position_m) - Vector3::from(scene.objects[0].pose.position_m)).norm()
}

/// Depth of a finger's lowest corner while the hand presses the fingers onto the table.
fn rammed(scene: &Scene, physics: Physics) -> f64 {
    let (mut world, mut script) = (World::with(scene, physics), Script::lift(&scene.objects[0].pose));
    script.legs[1].tool_m[2] = RAM_M;
    let mut deepest: f64 = 0.0;
    for _ in 0..2 * FIVE_SECONDS {
        let (seen, links) = (world.observe(), world.link_poses());
        let fingers = scene.robot.solids(&links).into_iter().filter(|(link, _)| *link > scene.robot.hand());
        deepest = fingers.fold(deepest, |deepest, (_, finger)| deepest.max(-finger.lowest_m()));
        world.step(&script.command(&seen));
    }
    deepest
}

/// The arm under noise alone, the block out of its way.
fn tracking(mut scene: Scene, physics: Physics, index: u64) -> f64 {
    scene.objects[0].pose.position_m = [0.1, 0.7, BLOCK_EDGE_M / 2.0];
    let mut noise = Disturbance::new(&paper_robot(), &SimulateSettings::default(), stream(0, "tracking", index));
    let mut world = World::with(&scene, physics);
    let mut worst: f64 = 0.0;
    for _ in 0..FIVE_SECONDS {
        let (before, action) = (world.observe().state.q, noise.apply(&Joints::zeros(JOINTS)));
        world.step(&action);
        let after = world.observe().state.q;
        worst = (0..ARM_JOINTS).fold(worst, |w, i| w.max((after[i] - before[i] - CONTROL_DT_S * action[i]).abs()));
    }
    worst
}
