//! Time of a complete plan, per task: `cargo bench --bench plan`. Each sample plans the next of many random scenes.

use criterion::{Criterion, criterion_group, criterion_main};
use hilt::config::{PlanSettings, SceneSettings};
use hilt::plan::Planner;
use hilt::seed::stream;
use hilt::tasks::{Task, draw_scene};

fn plans(c: &mut Criterion) {
    for task in Task::ALL {
        let mut planner = Planner::new(&PlanSettings::default());
        let mut index = 0;
        c.bench_function(&format!("plan {task}"), |b| {
            b.iter(|| {
                let scene = draw_scene(task, &SceneSettings::default(), &mut stream(0, "scene", index))
                    .expect("the default area has room");
                let plan = planner.plan(index, &scene, &mut stream(0, "plan", index)).expect("every default scene has a plan");
                index += 1;
                plan
            });
        });
    }
}

criterion_group!(benches, plans);
criterion_main!(benches);
