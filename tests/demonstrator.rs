//! The demonstrator in the loop: planner, follower and contact physics together, with the paper's noise on every command.

use hilt::config::{ChosenTask, Pipeline, Preset, SimulateSettings, Source};
use hilt::demo::{Episode, Phase};
use hilt::interrupt::Interrupt;
use hilt::plan::Planner;
use hilt::robot::file::built_in::names;
use hilt::seed::stream;
use hilt::sim::{Disturbance, Follower, run_episode};
use hilt::task::Spread;
use hilt::task::built_in::{of_the_paper, pick_up};
use hilt::tasks::draw_scene;
use std::path::Path;

/// Episodes per task: enough that a broken demonstrator is seen, few enough to be fast.
const EPISODES: u64 = 8;

fn demonstrate(pipeline: &Pipeline, settings: &SimulateSettings, index: u64) -> Episode {
    let scene = draw_scene(&pipeline.robot, &pipeline.task, &pipeline.scene, &mut stream(0, "demonstrator.scene", index))
        .expect("there is room");
    let plan = Planner::new(&pipeline.robot, &pipeline.task, &pipeline.plan)
        .plan(index, &scene, &mut stream(0, "demonstrator.search", index))
        .expect("a plan");
    let mut follower = Follower::new(&plan).expect("the plan has every phase");
    let mut disturbance = Disturbance::new(&pipeline.robot, settings, stream(0, "demonstrator.noise", index));
    run_episode(index, &scene, &mut follower, &mut disturbance, settings.max_steps, &Interrupt::default())
        .expect("not interrupted")
}

#[test]
fn every_task_is_solved_under_noise_without_a_needless_wait() {
    for task in of_the_paper() {
        let pipeline = Pipeline::defaults(&task);
        for index in 0..EPISODES {
            let episode = demonstrate(&pipeline, &pipeline.simulate, index);
            assert!(episode.success, "{task} {index}: {:?}", episode.failure);
            let mut phases: Vec<Phase> = episode.steps.iter().filter_map(|s| s.phase).collect();
            let closing = phases.iter().filter(|p| **p == Phase::Close).count();
            // From the open hand's 0.4 rad to the cube's 0.98 rad at 0.8 rad/s are 15 steps.
            assert!(closing < 30, "{task} {index}: {closing} steps to close the fingers");
            phases.dedup();
            assert!(phases.is_sorted(), "{task} {index} went back: {phases:?}");
            for (t, step) in episode.steps.iter().enumerate() {
                for (j, command) in step.commanded.iter().enumerate() {
                    assert!(
                        command.abs() <= episode.scene.robot.joints[j].velocity + 1e-6,
                        "{task} {index}, step {t}, joint {j}: {command}"
                    );
                }
            }
        }
    }
}

/// Tasks with several goals, cans and bins, which the paper does not have: goal after goal, the phases of each in their order.
#[test]
fn the_other_tasks_are_solved_by_every_robot_goal_after_goal() {
    for name in ["tower", "sort", "bin"] {
        let source = Source::BuiltIn(ChosenTask::read(name).expect("a task"), Preset::Best);
        for robot in names() {
            let pipeline = Pipeline::load(&source, &[format!("robot={robot}")]).expect("settings");
            for index in 0..EPISODES / 4 {
                let episode = demonstrate(&pipeline, &pipeline.simulate, index);
                assert!(episode.success, "{name} {robot} {index}: {:?}", episode.failure);
                let mut phases: Vec<Phase> = episode.steps.iter().filter_map(|s| s.phase).collect();
                phases.dedup();
                let goals = episode.scene.task.goals.len();
                assert_eq!(phases.chunk_by(|a, b| a < b).count(), goals, "{name} {robot} {index}: {phases:?}");
                // Each goal pays its milestones once: for the reach, the grasp, the lift (not onto the table) and the object in its place.
                let paid: f64 = episode.steps.iter().chain([&episode.last]).map(|step| step.reward).sum();
                let lifts = if name == "sort" { 0.0 } else { 1.0 };
                assert!((paid - goals as f64 * (0.01 + 0.1 + lifts + 10.0)).abs() < 1e-9, "{name} {robot} {index}: {paid}");
            }
        }
    }
}

/// Two fingers push a thumb of little friction away; the cube leans in the hand, touches the table, and comes no lower.
#[test]
fn what_leans_in_the_hand_is_put_down() {
    for task in of_the_paper().into_iter().filter(|task| *task != pick_up()) {
        let mut pipeline = Pipeline::defaults(&task);
        pipeline.scene.finger_friction = Spread::Fixed(0.2);
        for index in 0..EPISODES {
            let episode = demonstrate(&pipeline, &pipeline.simulate, index);
            assert!(episode.success, "{task} {index}: {:?}", episode.failure);
        }
    }
}

#[test]
fn the_wall_of_the_fixture_is_passed_without_touching_it() {
    let wall = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/wall.toml");
    let pipeline = Pipeline::load(&Source::File(wall, None), &[]).expect("the fixture is a pipeline file");
    for index in 0..EPISODES {
        let episode = demonstrate(&pipeline, &pipeline.simulate, index);
        assert!(episode.success, "{index}: {:?}", episode.failure);
        assert!(episode.steps.iter().all(|s| !s.contacts.robot_obstacle), "{index}: the arm touched the wall");
    }
}

#[test]
fn a_pushed_arm_is_commanded_back_to_the_plan() {
    let pipeline = Pipeline::defaults(&pick_up());
    let mut settings = SimulateSettings { noise_variance: 0.0, ..pipeline.simulate.clone() };
    settings.pulses.probability = 0.02;
    // While a push lasts, the commands turn against it: the label of a push is the way back.
    let (mut lean, mut pushed) = (0.0, 0);
    for index in 0..EPISODES {
        let steps = demonstrate(&pipeline, &settings, index).steps;
        for pair in steps.windows(2).filter(|w| w.iter().all(|s| s.phase == Some(Phase::Approach))) {
            let push = |j: usize| pair[0].executed[j] - pair[0].commanded[j];
            pushed += usize::from((0..pipeline.robot.arm).any(|j| push(j) != 0.0));
            lean += (0..pipeline.robot.arm).map(|j| push(j) * (pair[1].commanded[j] - pair[0].commanded[j])).sum::<f64>();
        }
    }
    assert!(pushed > 0, "no push in any approach: nothing was tested");
    assert!(lean < 0.0, "over {pushed} pushed steps the commands follow the push instead of correcting it: {lean}");
}
