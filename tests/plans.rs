//! Properties of plans, over random scenes of all tasks.

use hilt::config::{PlanSettings, SceneSettings};
use hilt::plan::{Plan, Planner};
use hilt::seed::stream;
use hilt::tasks::{Task, draw_scene};

fn plan(planner: &mut Planner, task: Task, index: u64) -> Result<Plan, String> {
    let scene = draw_scene(task, &SceneSettings::default(), &mut stream(1, "scene", index)).expect("room");
    planner
        .plan(index, &scene, &mut stream(1, "plan", index))
        .map_err(|e| format!("{task} {index} block {:?} {:?}: {e}", scene.block.position_m, scene.context))
}

#[test]
fn scratch() {
    let mut planner = Planner::new(&PlanSettings::default());
    for task in Task::ALL {
        let t = std::time::Instant::now();
        let (mut lengths, mut fails, mut times) = (vec![], 0, vec![]);
        for i in 0..200 {
            let t = std::time::Instant::now();
            match plan(&mut planner, task, i) {
                Ok(p) => lengths.push(p.waypoints.len()),
                Err(e) => {
                    fails += 1;
                    if fails < 6 {
                        println!("{e}");
                    }
                }
            }
            times.push(t.elapsed().as_secs_f64() * 1e3);
        }
        lengths.sort();
        times.sort_by(f64::total_cmp);
        println!(
            "{task}: fails {fails} lengths p50 {:?} p95 {:?} max {:?}; ms p50 {:.1} p95 {:.1}; total {:?}",
            lengths.get(lengths.len() / 2),
            lengths.get(lengths.len() * 95 / 100),
            lengths.last(),
            times[100],
            times[190],
            t.elapsed()
        );
    }
}
