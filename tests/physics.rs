//! The physics that everything else stands on.
mod scripted;

use hilt::config::{SceneSettings, SimulateSettings};
use hilt::scene::Scene;
use hilt::sim::{Controller, Disturbance, World, run_episode};
use hilt::state::State;
use hilt::tasks::{Task, draw_scene};
use scripted::Script;

#[test]
fn probe() {
    let scene = draw_scene(Task::PickUp, &SceneSettings::default(), &mut hilt::seed::stream(1, "probe", 0)).unwrap();
    println!("block {:?}", scene.block);
    let mut world = World::new(&scene);
    let mut script = Script::lift(&scene.block, 0.0);
    for i in 0..220 {
        let seen = world.observe();
        if i % 5 == 0 {
            println!(
                "{i} leg {} tool {:.4?} block {:.5?} f {:.3?} q6.. {:.3?} n {:.2?} t {} v {:.4}",
                script.at,
                seen.tool_m,
                seen.state.block.position_m,
                seen.gripped(),
                &seen.state.q_rad[6..],
                seen.contacts.finger_block_n,
                seen.contacts.block_table,
                seen.block_speed_m_s
            );
        }
        let a = script.command(&seen);
        world.step(&a);
    }
}
